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

TEST(Neighbours, EachPeerIsToldOfTheOthers) {
  Script s(server());
  s.join(1);
  s.login(2);
  const auto told = [&](std::uint32_t connection) {
    const auto packet = s.side.next_packet({connection}, flow_test::now_ms(s.at));
    const Bytes bytes = flow_test::joined(*packet);
    const auto control = decode_control(std::string(bytes.begin(), bytes.end()));
    return std::get<Accepts>(control.value()).neighbours;
  };
  EXPECT_EQ(told(2), std::vector{Script::peer_id(1)});
  // Another bridge of this graph has a client: it may be in the graph of ours.
  say_claim(s, {side_id(9), {}, {}, {side_id(77), Script::peer_id(2)}});
  s.login(3);
  EXPECT_EQ(told(3), (std::vector{side_id(77), Script::peer_id(1), Script::peer_id(2)}));
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

// Beside another bridge: it need not wait until the link is dead.
TEST(Neighbours, WhoseLinkIsLostReleasesItsTopics) {
  Script s(server());
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge"), topic("/a").sub(1)});
  const auto session = s.join(1);
  s.pass(1000);
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  s.pass(250);
  EXPECT_EQ(s.did(), "mirror 2 /a reliable volatile 10\nclaim [11?]\nclaim [11]\n");
  s.lose(1);
  EXPECT_EQ(s.did(), "claim []\n");
  s.join(2, session);
  s.say(2, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  EXPECT_EQ(s.did(), "claim [11?]\n");  // it settles again
  EXPECT_EQ(s.said(2), "");
  s.pass(250);
  EXPECT_EQ(s.said(2).substr(0, 11), "demand 1 on");
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
