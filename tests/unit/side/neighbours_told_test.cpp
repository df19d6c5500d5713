// Which neighbours a peer is told of.
#include <gtest/gtest.h>

#include <set>

#include "unit/side/neighbours.hpp"

namespace connect_bridge::side_test {
namespace {

TEST(Neighbours, WhoComesIsToldOfThoseWhoAreThere) {
  Script s(server());
  s.site = "here";
  EXPECT_EQ(arrive(s, 1, 7), Sides{});
  EXPECT_EQ(arrive(s, 2, 7), Sides{Script::peer_id(1)});
  EXPECT_EQ(told(s, 1), std::nullopt);  // the first need not wait
  // Another bridge of this graph has a client: it may be in the graph of ours.
  const Place place = place_in(7);
  say_claim(s, {side_id(9), {}, {}, {{side_id(77), place}, {Script::peer_id(2), place}}});
  EXPECT_EQ(arrive(s, 3, 7), (Sides{side_id(77), Script::peer_id(1), Script::peer_id(2)}));
}

TEST(Neighbours, AreToldAgainWhenTheyChange) {
  const Place place = place_in(7);
  Script s(server());
  s.site = "here";
  arrive(s, 1, 7);
  s.pass(100);
  // Its clients may have been there before ours.
  say_claim(s, {side_id(9), {}, {}, {{side_id(77), place}}});
  EXPECT_EQ(told(s, 1), Sides{side_id(77)});
  // Not those that come now.
  say_claim(s, {side_id(9), {}, {}, {{side_id(77), place}, {side_id(78), place}}});
  s.pass(2000);
  EXPECT_EQ(told(s, 1), std::nullopt);
  say_claim(s, {side_id(8), {}, {}, {{side_id(79), place}}});
  EXPECT_EQ(told(s, 1), (Sides{side_id(77), side_id(79)}));
}

TEST(Neighbours, AreToldOnceASecond) {
  const Place place = place_in(7);
  Script s(server());
  s.site = "here";
  arrive(s, 1, 7);
  for (std::uint8_t i = 1; i <= 50; ++i) {
    say_claim(s, {side_id(i), {}, {}, {{side_id(static_cast<std::uint8_t>(150 + i)), place}}});
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

TEST(Neighbours, TwoOfOneNameThatLiveAreToldOfEachOther) {
  Script s(server());
  Identity who;
  who.name = "fleet";
  arrive(s, 1, {}, who);
  s.pass(1000);
  EXPECT_EQ(arrive(s, 2, {}, who), Sides{});
  s.fall_silent(1);
  s.pass(1000);
  EXPECT_EQ(told(s, 2), std::nullopt);
  EXPECT_EQ(arrive(s, 3, {}, who), Sides{});
  s.pass(1250);  // the second gives signs of life, the first does not
  EXPECT_EQ(told(s, 3), Sides{Script::peer_id(2)});
  s.pass(3000);
  EXPECT_EQ(told(s, 3), std::nullopt);
}

TEST(Neighbours, WhoDoesNotSayItsDomainIsToldOfNobodyElsewhere) {
  const Place place = place_in(7);
  Script s(server());
  s.site = "here";
  say_claim(s, {side_id(9), {}, {}, {{side_id(77), place}, {side_id(78)}}});
  EXPECT_EQ(arrive(s, 1), Sides{});
  EXPECT_EQ(arrive(s, 2, 8), Sides{Script::peer_id(1)});
  EXPECT_EQ(arrive(s, 3, 7), (Sides{side_id(77), Script::peer_id(1)}));
  s.site = "";
  EXPECT_EQ(arrive(s, 4, 7), (Sides{Script::peer_id(1), Script::peer_id(3)}));
}

TEST(Neighbours, AreNotClaimedWithoutAPlace) {
  Script s(server());
  s.site = "here";
  arrive(s, 1);
  arrive(s, 2, 7);
  s.site = "";
  arrive(s, 3, 7);
  s.pass(20);
  std::set<Token128> claimed;
  while (const auto action = s.side.next_action())
    if (const auto* publish = std::get_if<Publish>(&*action))
      if (const auto claim = parse_claim(publish->payload.view()))
        for (const auto& peer : claim->peers) claimed.insert(peer.side);
  EXPECT_EQ(claimed, std::set{Script::peer_id(2)});
}

// A house has networks of both kinds.
TEST(Neighbours, TwoFamiliesMayBeOneNetwork) {
  Script s(server());
  s.site = "4 one";
  arrive(s, 1, 7);
  s.site = "6 one";
  EXPECT_EQ(arrive(s, 2, 7), Sides{Script::peer_id(1)});
  s.site = "6 two";
  EXPECT_EQ(arrive(s, 3, 7), Sides{Script::peer_id(1)});
  s.site = "loopback";
  EXPECT_EQ(arrive(s, 4, 7), Sides{});
}

TEST(Neighbours, ADomainStaysWhileTheConnectionDoes) {
  Script s(server());
  arrive(s, 1, 7);
  Accepts other = with_neighbours({});
  other.domain = 8;
  s.say(1, other);
  EXPECT_EQ(arrive(s, 2, 8), Sides{});
  EXPECT_EQ(arrive(s, 3, 7), Sides{Script::peer_id(1)});
}

TEST(Neighbours, AreNotToldToWhoDoesNotWaitAnyLonger) {
  const Place place = place_in(7);
  Script s(server());
  s.site = "here";
  arrive(s, 1, 7);
  s.pass(5000);
  say_claim(s, {side_id(9), {}, {}, {{side_id(77), place}}});
  s.pass(3000);
  EXPECT_EQ(told(s, 1), std::nullopt);
  s.give(PolicyChanged{Policy({everything()})});
  EXPECT_EQ(told(s, 1), Sides{});
}

// However many there are, what one of them does makes none of the others be told, or looked at.
TEST(Neighbours, AThousandInOneNetworkDoNotConcernEachOther) {
  constexpr std::uint32_t kLinks = 1000;
  auto options = server();
  options.links_max = options.identity_links_max = kLinks;
  Script s(options);
  s.site = "here";
  std::size_t told_again = 0;
  for (std::uint32_t i = 1; i <= kLinks; ++i) {
    arrive(s, i, 7);
    told(s, i);
  }
  s.pass(6000);
  for (std::uint32_t i = 1; i <= kLinks; ++i) told_again += told(s, i).has_value() ? 1 : 0;
  EXPECT_EQ(told_again, 0U);
  for (std::uint32_t domain = 0; domain < 20; ++domain) {
    Accepts accepts = with_neighbours({});
    accepts.domain = domain;
    s.say(1, accepts);
    s.pass(100);
  }
  say_claim(s, {side_id(9), {}, {}, {{side_id(99), place_in(7)}}});
  s.lose(2);
  s.pass(2000);
  for (std::uint32_t i = 1; i <= kLinks; ++i) told_again += told(s, i).has_value() ? 1 : 0;
  EXPECT_EQ(told_again, 0U);
}

}  // namespace
}  // namespace connect_bridge::side_test
