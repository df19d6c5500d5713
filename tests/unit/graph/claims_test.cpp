#include "core/graph/claims.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/hex.hpp"
#include "core/base/random.hpp"

namespace connect_bridge {
namespace {

Gid filled(std::uint8_t n) {
  Gid result;
  result.bytes.fill(n);
  return result;
}
Token128 side(std::uint8_t n) {
  Token128 result;
  result.bytes.fill(n);
  return result;
}

using namespace std::chrono_literals;

constexpr TimePoint kNow{};

// A round trip through the bytes.
std::optional<Claim> through(const Claim& claim) {
  return parse_claim(serialize(claim, 1'700'000'000'123'456'789).view());
}

TEST(Claims, RoundTrip) {
  for (const std::size_t count : {0, 1, 2, 1000}) {
    Claim claim{side(0xab), {}};
    for (std::size_t i = 0; i < count; ++i)
      claim.origins.push_back(filled(static_cast<std::uint8_t>(i)));
    const auto back = through(claim);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->side, claim.side);
    EXPECT_EQ(back->origins, claim.origins);
  }
}

TEST(Claims, ARoundTripOfAllItsWords) {
  Claim claim{side(0xab), {filled(1), filled(2)}, {filled(3)}, {filled(6), filled(1)}};
  claim.good_for = 4321ms;
  EXPECT_EQ(through(claim), claim);
  EXPECT_GE(claim_bytes(claim), serialize(claim, 0).size());
}

TEST(Claims, NamesSoManyOriginsAtMost) {
  const std::vector<Gid> many(kClaimOriginsMax - 1, filled(1));
  const Claim claim{side(1), many, {}, many};
  const auto payload = serialize(claim, 0);
  EXPECT_LE(payload.size(), kClaimBytesMax);
  const auto parsed = parse_claim(payload.view());
  EXPECT_EQ(parsed->services.size(), many.size());
  EXPECT_EQ(parsed->origins.size(), 1);
}

TEST(Claims, IsALogMessageInCdr) {
  const auto payload = serialize({side(0x01), {}}, 0x0102'0304LL * 1'000'000'000 + 5);
  const auto bytes = payload.view();
  const Bytes head{0, 1, 0, 0, 4, 3, 2, 1, 5, 0, 0, 0, 10, 0, 0, 0, 24, 0, 0, 0, 'c', 'o'};
  EXPECT_EQ(Bytes(bytes.begin(), bytes.begin() + 22), head);
  EXPECT_EQ(bytes.size() % 4, 0U);
  // Both strings end with a zero, which their lengths count.
  EXPECT_EQ(bytes[20 + 23], 0);
  EXPECT_EQ(bytes[20 + 24], 33);
}

TEST(Claims, CutShortItIsNoneOrASmallerOne) {
  const auto payload = serialize({side(7), {filled(1), filled(2)}}, 0);
  // The name and the text come after the other fields of a Log; without them there is no claim.
  const std::size_t text_end = 20 + 24 + 4 + 32 + 2 * 49 + 1;
  for (std::size_t size = 0; size < payload.size(); ++size)
    EXPECT_EQ(parse_claim(payload.view().first(size)).has_value(), size >= text_end) << size;
}

TEST(Claims, GarbageIsNone) {
  Random random(1);
  const auto payload = serialize({side(7), {filled(1), filled(2)}}, 0);
  for (int i = 0; i < 20'000; ++i) {
    Bytes bytes(payload.view().begin(), payload.view().end());
    for (int changes = 0; changes < 3; ++changes)
      bytes[random.below(bytes.size())] = static_cast<std::uint8_t>(random.next());
    if (const auto claim = parse_claim(bytes)) {
      EXPECT_LE(claim->origins.size(), 2U);
    }
    Bytes noise(random.below(100));
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random.next());
    if (noise.size() > 1) noise[0] = 0, noise[1] = 1;
    EXPECT_FALSE(parse_claim(noise));
  }
}

TEST(Claims, AnotherLogOrAnotherVersionIsNone) {
  const auto payload = serialize({side(7), {filled(1)}}, 0);
  const auto changed = [&](std::size_t at, std::uint8_t value) {
    Bytes bytes(payload.view().begin(), payload.view().end());
    bytes[at] = value;
    return parse_claim(bytes).has_value();
  };
  EXPECT_FALSE(changed(1, 0));          // big-endian
  EXPECT_FALSE(changed(20 + 22, '4'));  // "connect_bridge claims 4"
  EXPECT_FALSE(changed(16, 0));         // an empty string has length 1
  EXPECT_FALSE(changed(19, 0xff));      // a length beyond everything
  EXPECT_FALSE(changed(48, 'A'));       // upper case
  EXPECT_FALSE(changed(48, ' '));
  EXPECT_FALSE(changed(81, '+'));  // in place of the first origin
  EXPECT_TRUE(changed(12, 20));    // the level means nothing
}

TEST(Claims, WhatAnotherClaimsFirstIsItsOwn) {
  Claims claims(side(5));
  EXPECT_TRUE(claims.update(filled(100), {side(4), {filled(1)}}, kNow));
  EXPECT_TRUE(claims.update(filled(101), {side(6), {filled(2)}}, kNow));
  EXPECT_TRUE(claims.taken(filled(1), false));
  EXPECT_TRUE(claims.taken(filled(2), false));
  EXPECT_FALSE(claims.taken(filled(3), false));
  EXPECT_TRUE(claims.is_here(side(4)));
  EXPECT_TRUE(claims.is_here(side(6)));
  EXPECT_FALSE(claims.is_here(side(7)));
}

TEST(Claims, OfTwoThatClaimAtOnceTheSmallerSideIdHoldsTheOrigin) {
  Claims claims(side(5));
  claims.update(filled(100), {side(4), {filled(1), filled(3)}}, kNow);
  claims.update(filled(101), {side(6), {filled(2), filled(3)}}, kNow);
  EXPECT_TRUE(claims.taken(filled(1), true));
  EXPECT_FALSE(claims.taken(filled(2), true));
  EXPECT_TRUE(claims.taken(filled(3), true));  // one of several
}

TEST(Claims, ANewClaimReplacesTheOldOne) {
  Claims claims(side(5));
  claims.update(filled(100), {side(4), {filled(1), filled(2)}}, kNow);
  EXPECT_TRUE(claims.update(filled(100), {side(4), {filled(2), filled(3)}}, kNow));
  EXPECT_FALSE(claims.taken(filled(1), false));
  EXPECT_TRUE(claims.taken(filled(2), false));
  EXPECT_TRUE(claims.taken(filled(3), false));
}

TEST(Claims, OurOwnIsNoOther) {
  Claims claims(side(5));
  EXPECT_FALSE(claims.update(filled(100), {side(5), {filled(1)}}, kNow));
  EXPECT_FALSE(claims.taken(filled(1), false));
  EXPECT_FALSE(claims.is_here(side(5)));
}

TEST(Claims, OfTwoThatHoldAnOriginOneMayGo) {
  Claims claims(side(5));
  claims.update(filled(100), {side(3), {filled(1)}}, kNow);
  claims.update(filled(101), {side(4), {filled(1)}}, kNow);
  claims.retain({filled(100), filled(101)}, {filled(101)}, kNow);
  EXPECT_TRUE(claims.taken(filled(1), false));
  claims.retain({filled(101)}, {}, kNow);
  EXPECT_FALSE(claims.taken(filled(1), false));
}

TEST(Claims, ABridgeTheGraphDoesNotShowYetIsKept) {
  Claims claims(side(5));
  claims.update(filled(100), {side(4), {filled(1)}}, kNow);
  claims.retain({}, {}, kNow);
  EXPECT_TRUE(claims.taken(filled(1), false));
  claims.retain({}, {filled(100)}, kNow);
  claims.retain({filled(100)}, {filled(100)}, kNow);
  EXPECT_TRUE(claims.taken(filled(1), false));
  claims.retain({filled(100)}, {}, kNow);
  EXPECT_FALSE(claims.taken(filled(1), false));
  EXPECT_FALSE(claims.is_here(side(4)));
}

// The graph may show the mirrors of a bridge that has left it a moment longer.
TEST(Claims, TheMirrorsOfABridgeThatLeftAreItsOwnForAWhile) {
  Claims claims(side(5));
  claims.update(filled(100), {side(4), {filled(1)}, {filled(7)}}, kNow);
  claims.retain({filled(100)}, {}, kNow);
  EXPECT_FALSE(claims.taken(filled(1), false));
  EXPECT_FALSE(claims.expire(kNow + 1s));  // no claim has changed
  EXPECT_TRUE(claims.mirrors().contains(filled(7)));
  EXPECT_FALSE(claims.expire(kNow + 31s));
  EXPECT_TRUE(claims.mirrors().empty());
  EXPECT_EQ(claims.deadline(), std::nullopt);
}

TEST(Claims, AServiceIsABridgesForAMomentLonger) {
  Claims claims(side(5));
  const Gid service = service_gid("/s");
  Claim claim{side(4), {}, {}, {service}};
  claim.good_for = 4s;
  claims.update({}, claim, kNow);
  EXPECT_TRUE(claims.serves(service));
  claims.update({}, {side(4)}, kNow);
  EXPECT_FALSE(claims.service_taken(service, false));
  EXPECT_TRUE(claims.serves(service));
  EXPECT_FALSE(claims.expire(kNow + 999ms));
  EXPECT_TRUE(claims.expire(kNow + 1s));
  EXPECT_FALSE(claims.serves(service));
  // One that fell silent may be shown for longer.
  claims.update({}, claim, kNow);
  EXPECT_TRUE(claims.expire(kNow + 4s));
  EXPECT_FALSE(claims.expire(kNow + 20s));
  EXPECT_TRUE(claims.serves(service));
  EXPECT_TRUE(claims.expire(kNow + 35s));
  EXPECT_FALSE(claims.serves(service));
}

TEST(Claims, EachServiceThatEndedHasATimeOfItsOwn) {
  Claims claims(side(5));
  const Gid first = service_gid("/first"), second = service_gid("/second");
  const auto say = [&](std::vector<Gid> services, Duration at) {
    claims.update({}, Claim{side(4), {}, {}, std::move(services)}, kNow + at);
  };
  say({first, second}, 0s);
  say({second}, 1s);
  say({}, 1900ms);
  EXPECT_TRUE(claims.expire(kNow + 2s));
  EXPECT_FALSE(claims.serves(first));
  EXPECT_TRUE(claims.serves(second));
  EXPECT_TRUE(claims.expire(kNow + 2900ms));
  EXPECT_FALSE(claims.serves(second));
}

TEST(Claims, OneThatDoesNotSayHowLongItIsGoodIsForgotten) {
  Claims claims(side(5));
  const auto claim = parse_claim(serialize(Claim{side(4), {filled(1)}}, 0).view());
  ASSERT_TRUE(claim);
  claims.update({}, *claim, kNow);
  EXPECT_TRUE(claims.expire(kNow + 10s));
  EXPECT_FALSE(claims.any());
}

TEST(Claims, BeyondSoManyBridgesNewOnesAreNotHeard) {
  Claims claims(side(255));
  const auto bridge = [](int i) {
    Token128 id;
    id.bytes[0] = static_cast<std::uint8_t>(i % 250);
    id.bytes[1] = static_cast<std::uint8_t>(i / 250);
    id.bytes[2] = 1;
    return id;
  };
  for (int i = 0; i < 256; ++i) EXPECT_TRUE(claims.update({}, {bridge(i), {}}, kNow));
  EXPECT_FALSE(claims.update({}, {bridge(256), {filled(1)}}, kNow));
  EXPECT_TRUE(claims.update({}, {bridge(255), {filled(1)}}, kNow));
  EXPECT_TRUE(claims.taken(filled(1), false));
}

// Peers choose the ids of origins.
TEST(Claims, NoOriginStandsForAService) {
  Claims claims(side(5));
  const Gid service = service_gid("/s");
  claims.update({}, {side(4), {service}}, kNow);
  EXPECT_FALSE(claims.service_taken(service, false));
  EXPECT_FALSE(claims.serves(service));
  claims.update({}, {side(4), {}}, kNow);
  EXPECT_FALSE(claims.serves(service));
}

TEST(Claims, AServiceHasTheSameNumberInEveryProcess) {
  EXPECT_EQ(service_gid("/s"), service_gid("/s"));
  EXPECT_NE(service_gid("/s"), service_gid("/t"));
  const Gid gid = service_gid("/map_server/load");
  EXPECT_EQ(to_hex(gid.bytes), "dbfc2832abd5d1e4dabfbef20d28521c8512de92bf203137");
}

}  // namespace
}  // namespace connect_bridge
