// Two bridges in one graph, whatever its middleware tells of its endpoints.
#include <gtest/gtest.h>

#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"
#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

using namespace std::chrono_literals;

Token128 side_id(std::uint8_t n) {
  Token128 id;
  id.bytes.fill(n);
  return id;
}

// A claim whose sample does not tell its publisher.
void say_claim(Script& s, Claim claim) {
  s.give(MessageTaken{{1}, Gid{}, 0, serialize(claim, 0)});
}

Accepts with_neighbours(std::vector<Token128> sides) {
  Accepts accepts{{{{"/**"}, {}}}, {}};
  accepts.neighbours = std::move(sides);
  return accepts;
}

// The neighbours that the peer is told of now; nothing: of none.
std::optional<std::vector<Token128>> told(Script& s, std::uint32_t connection) {
  std::optional<std::vector<Token128>> sides;
  while (const auto packet = s.side.next_packet({connection}, flow_test::now_ms(s.at))) {
    if (!packet->text) continue;
    const Bytes bytes = flow_test::joined(*packet);
    const auto control = decode_control(std::string(bytes.begin(), bytes.end()));
    if (const auto* accepts = std::get_if<Accepts>(&control.value())) sides = accepts->neighbours;
  }
  return sides;
}

// A peer logs in, and says what it accepts and in which domain it is. What it is told of.
std::optional<std::vector<Token128>> arrive(Script& s, std::uint32_t connection,
                                            std::optional<std::uint32_t> domain = {},
                                            const Identity& who = {}) {
  s.login(connection, {}, who);
  const auto first = told(s, connection);
  Accepts accepts = with_neighbours({});
  accepts.domain = domain;
  s.say(connection, accepts);
  const auto then = told(s, connection);
  return then ? then : first;
}

using Sides = std::vector<Token128>;

TEST(Neighbours, WhoComesIsToldOfThoseWhoAreThere) {
  Script s(server());
  EXPECT_EQ(arrive(s, 1), Sides{});
  EXPECT_EQ(arrive(s, 2), Sides{Script::peer_id(1)});
  EXPECT_EQ(told(s, 1), std::nullopt);  // the first need not wait
  // Another bridge of this graph has a client: it may be in the graph of ours.
  say_claim(s, {side_id(9), {}, {}, {{side_id(77)}, {Script::peer_id(2)}}});
  EXPECT_EQ(arrive(s, 3), (Sides{side_id(77), Script::peer_id(1), Script::peer_id(2)}));
}

TEST(Neighbours, AreToldAgainWhenTheyChange) {
  Script s(server());
  arrive(s, 1);
  s.pass(100);
  // Its clients may have been there before ours.
  say_claim(s, {side_id(9), {}, {}, {{side_id(77)}}});
  EXPECT_EQ(told(s, 1), Sides{side_id(77)});
  // Not those that come now.
  say_claim(s, {side_id(9), {}, {}, {{side_id(77)}, {side_id(78)}}});
  s.pass(2000);
  EXPECT_EQ(told(s, 1), std::nullopt);
  say_claim(s, {side_id(8), {}, {}, {{side_id(79)}}});
  EXPECT_EQ(told(s, 1), (Sides{side_id(77), side_id(79)}));
}

TEST(Neighbours, AreToldOnceASecond) {
  Script s(server());
  arrive(s, 1);
  for (std::uint8_t i = 1; i <= 50; ++i) {
    say_claim(s, {side_id(i), {}, {}, {{side_id(static_cast<std::uint8_t>(150 + i))}}});
    s.pass(10);
    EXPECT_EQ(told(s, 1).has_value(), i == 1) << int{i};
  }
  s.pass(500);
  EXPECT_EQ(told(s, 1).value_or(Sides{}).size(), 50U);
  s.pass(5000);
  EXPECT_EQ(told(s, 1), std::nullopt);
}

TEST(Neighbours, AreInOneDomainAndOneNetwork) {
  Script s(server());
  s.site = "here";
  EXPECT_EQ(arrive(s, 1, 7), Sides{});
  EXPECT_EQ(arrive(s, 2, 8), Sides{});
  s.site = "elsewhere";
  EXPECT_EQ(arrive(s, 3, 7), Sides{});
  s.site = "here";
  EXPECT_EQ(arrive(s, 4, 7), Sides{Script::peer_id(1)});
  // One that does not say its domain.
  EXPECT_EQ(arrive(s, 5), (Sides{Script::peer_id(1), Script::peer_id(2), Script::peer_id(4)}));
}

TEST(Neighbours, TheClaimOfABridgeSaysWhereItsPeersAre) {
  Script s(server());
  Script other(server());
  for (Script* script : {&s, &other}) script->site = "here";
  arrive(other, 1, 7);
  arrive(other, 2, 8);
  other.pass(20);
  while (const auto action = other.side.next_action()) {
    const auto* publish = std::get_if<Publish>(&*action);
    auto claim = publish ? parse_claim(publish->payload.view()) : std::nullopt;
    if (!claim) continue;
    claim->side = side_id(9);
    say_claim(s, *claim);
  }
  EXPECT_EQ(arrive(s, 3, 8), Sides{Script::peer_id(2)});
}

TEST(Neighbours, WhoIsStartedAgainIsNotToldOfItself) {
  Script s(server());
  Identity who;
  who.name = "operator";
  arrive(s, 1, {}, who);
  EXPECT_EQ(arrive(s, 2, {}, who), Sides{});  // the same node, another process
  who.name = "another";
  EXPECT_EQ(arrive(s, 3, {}, who), (Sides{Script::peer_id(1), Script::peer_id(2)}));
}

TEST(Neighbours, ANewcomerFeedsWhenItHasHeardThem) {
  Script s(client());
  s.graph({topic("/a").sub(1)});
  s.be_welcomed(1);
  s.say(1, with_neighbours({side_id(7), side_id(8)}));
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  s.said(1);
  s.pass(2000);
  EXPECT_EQ(s.said(1), "");
  say_claim(s, {side_id(7), {}});
  say_claim(s, {side_id(8), {}});
  s.pass(249);
  EXPECT_EQ(s.said(1), "");
  s.pass(1);
  EXPECT_EQ(s.said(1), "demand 1 on\n");
}

TEST(Neighbours, ANewcomerGivesWayToOneThatFeeds) {
  Script s(client());
  s.graph({topic("/a").sub(1)});
  s.be_welcomed(1);
  s.say(1, with_neighbours({side_id(7)}));
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  s.pass(3000);
  EXPECT_EQ(s.did().find("claim [11"), std::string::npos);  // who feeds must not give way to it
  say_claim(s, {side_id(7), {{gid(11), true}}});
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
}

TEST(Neighbours, OneThatIsElsewhereIsWaitedForAtTheStartOnly) {
  Script s(client());
  s.graph({topic("/a").sub(1), topic("/b").sub(2)});
  s.be_welcomed(1);
  s.say(1, with_neighbours({side_id(7)}));
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  s.said(1);
  s.pass(3499);
  EXPECT_EQ(s.said(1), "");
  s.pass(1);
  EXPECT_EQ(s.said(1), "demand 1 on\n");
  s.say(1, Offer{{channel(2, "/b", {origin(1, 12)})}});
  EXPECT_EQ(s.said(1), "demand 2 on\n");
}

// Whatever is handled first when that time is over.
TEST(Neighbours, WhatIsMadeAsTheWaitEndsIsClaimed) {
  Script s(client());
  s.graph({topic("/a").sub(1)});
  s.be_welcomed(1);
  s.say(1, with_neighbours({side_id(7)}));
  s.did();
  s.at += 3500;
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  s.pass(0);
  s.pass(250);
  EXPECT_NE(s.did().find("claim [11]"), std::string::npos);
  EXPECT_NE(s.said(1).find("demand 1 on"), std::string::npos);
}

// Two who have waited for the same one have not heard each other's claims.
TEST(Neighbours, BesideAnotherBridgeItClaimsBeforeItFeeds) {
  Script s(client());
  s.graph({topic("/a").sub(1)});
  s.be_welcomed(1);
  s.say(1, with_neighbours({side_id(7)}));
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  say_claim(s, {side_id(8), {}});
  s.pass(3500);
  s.said(1);
  EXPECT_NE(s.did().find("claim [11?]"), std::string::npos);
  s.pass(249);
  EXPECT_EQ(s.said(1), "");
  s.pass(1);
  EXPECT_EQ(s.said(1), "demand 1 on\n");
}

TEST(Neighbours, AReconnectWaitsForNobody) {
  Script s(client());
  s.graph({topic("/a").sub(1)});
  s.be_welcomed(1);
  s.pass(3500);
  s.lose(1);
  s.pass(1000);
  s.be_welcomed(2);
  s.say(2, with_neighbours({side_id(7)}));
  s.say(2, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  EXPECT_NE(s.said(2).find("demand 1 on"), std::string::npos);
}

// However often a peer names others, and whomever.
TEST(Neighbours, AHostilePeerMakesNobodyWaitAgain) {
  Script s(client());
  s.graph({topic("/a").sub(1)});
  s.be_welcomed(1);
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  for (std::uint8_t i = 1; i <= 7; ++i) {
    s.say(1, with_neighbours({side_id(i), side_id(static_cast<std::uint8_t>(100 + i))}));
    s.pass(499);
  }
  s.said(1);
  s.pass(7);
  EXPECT_EQ(s.said(1), "demand 1 on\n");
  s.say(1, with_neighbours({side_id(99)}));
  s.say(1, Offer{{channel(2, "/a2", {origin(1, 12)})}});
  s.graph({topic("/a").sub(1), topic("/a2").sub(2)});
  EXPECT_EQ(s.said(1), "demand 2 on\n");
}

TEST(Neighbours, WhoIsNotNamedAnyLongerIsNotWaitedFor) {
  Script s(client());
  s.graph({topic("/a").sub(1)});
  s.be_welcomed(1);
  s.say(1, with_neighbours({side_id(7)}));
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  s.pass(1000);
  s.said(1);
  s.say(1, with_neighbours({}));
  EXPECT_EQ(s.said(1), "demand 1 on\n");
}

TEST(Neighbours, ABridgeThatFallsSilentHoldsNothing) {
  Script s(server());
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge"), topic("/a").sub(1)});
  s.join(1);
  s.pass(1000);
  Claim claim{side_id(0), {{gid(11), true}}};
  claim.good_for = 3s;
  say_claim(s, claim);
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  s.pass(2000);
  say_claim(s, claim);  // a sign of life
  s.did();
  s.pass(2999);
  EXPECT_EQ(s.did(), "");
  s.pass(1);
  EXPECT_EQ(s.did(), "mirror 2 /a reliable volatile 10\nclaim [11?]\n");
  s.said(1);
  s.pass(250);
  EXPECT_EQ(s.said(1), "demand 1 on\n");
}

TEST(Neighbours, TheLastWordOfABridgeEndsItsClaims) {
  Script s(server());
  s.graph({topic("/a").sub(1)});
  s.join(1);
  s.pass(1000);
  say_claim(s, {side_id(0), {{gid(11), true}}});
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  EXPECT_EQ(s.did(), "");
  Claim last{side_id(0), {}};
  last.good_for = 0s;
  say_claim(s, last);
  EXPECT_EQ(s.did(), "mirror 2 /a reliable volatile 10\nclaim [11]\n");
}

TEST(Neighbours, AMirrorUnderAProxyIsNoOrigin) {
  Script s(server());
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge")});
  s.join(1);
  s.pass(1000);
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge"), topic("/a").pub(40, {}, "talker"),
           topic("/b").pub(41, {}, "talker")});
  s.pass(100);
  say_claim(s, {side_id(9), {}, {gid(40)}});
  s.pass(50);
  EXPECT_EQ(s.said(1), "offer 1/b[1]\n");
  // The bridge has ended it, but the graph still shows it.
  say_claim(s, {side_id(9), {}});
  s.pass(1000);
  EXPECT_EQ(s.said(1), "");
}

TEST(Neighbours, AProxysMirrorIsClaimedByItsId) {
  auto options = server();
  options.proxy_nodes = true;
  Script s(options);
  s.graph({topic("/a").sub(1)});
  s.join(1);
  s.pass(1000);
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  s.pass(2000);
  s.did();
  s.give(MirrorMade{{2}, gid(99)});
  s.pass(20);
  std::vector<Gid> named;
  while (const auto action = s.side.next_action())
    if (const auto* publish = std::get_if<Publish>(&*action))
      if (const auto claim = parse_claim(publish->payload.view())) named = claim->mirrors;
  EXPECT_EQ(named, std::vector{gid(99)});
}

}  // namespace
}  // namespace connect_bridge::side_test
