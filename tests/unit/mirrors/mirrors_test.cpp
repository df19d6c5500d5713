// How long mirrors live: losses, returns, two links with one origin.
#include <gtest/gtest.h>

#include "unit/mirrors/mirrors_script.hpp"

namespace connect_bridge::side_test {
namespace {

TEST(SideMirrors, AreUsedAgainAfterAReconnectWithoutDuplicates) {
  Mirrors s;
  s.message(1, 1, 1, "a", 10);
  s.message(1, 1, 1, "b", 20);
  EXPECT_EQ(s.did(), "publish 2 a\npublish 2 b\n");
  s.lose(1);
  s.pass(2000);
  EXPECT_EQ(s.join(2, s.session), s.session);
  s.pass(2000);  // it is open again: nothing ends
  EXPECT_EQ(s.did(), "");
  s.say(2, Offer{{channel(5, "/map", {origin(3, 11, latched())})}, true});
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.said(2), "demand 5 on has 3:20\n");
  s.message(2, 5, 3, "b", 20);  // the exporter's history
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.dropped(DropReason::kDuplicate), 1U);
  s.message(2, 5, 3, "c", 30);
  EXPECT_EQ(s.did(), "publish 2 c\n");
  EXPECT_EQ(s.status().links.at(0).connects, 2U);
}

// A node was killed and is back with another type, while its former publisher is still known.
TEST(SideMirrors, AnotherTypeOfTheNameIsTriedAgainWhenTheFirstEnds) {
  Mirrors s;
  s.say(1, OriginsChanged{{1}, {origin(2, 12)}, {}});
  ChannelOffer other = channel(2, "/map", {origin(1, 13)});
  other.type = "p/msg/Other";
  s.say(1, Offer{{other}, true});
  s.did();
  s.give(MirrorFailed{{4}, "type_mismatch", "the topic /map has another type here"});
  s.say(1, OriginsChanged{{1}, {}, {{1}}});
  s.pass(200);
  EXPECT_EQ(s.did(), "claim [11 12]\nunmirror 2\nclaim [12]\n");  // one with the first type is left
  s.say(1, Withdraw{{{1}}});
  s.pass(200);
  EXPECT_EQ(s.did(), "unmirror 3\nmirror 5 /map reliable volatile 10\nclaim [13]\n");
  s.give(MirrorFailed{{5}, "type_mismatch", "a node here publishes another type"});
  s.did();
  s.pass(20'000);
  EXPECT_EQ(s.did(), "");  // nothing has ended meanwhile
}

TEST(SideMirrors, WhatIsNotOfferedAgainGoesWhenTheRoundIsComplete) {
  Mirrors s;
  s.say(1, OriginsChanged{{1}, {origin(2, 12)}, {}});
  EXPECT_EQ(s.did(), "mirror 3 /map reliable volatile 10\nclaim [11 12]\n");
  s.lose(1);
  s.join(2, s.session);
  s.say(2, Offer{{channel(1, "/map", {origin(1, 12)})}, false});
  s.pass(1000);
  EXPECT_EQ(s.did(), "");
  s.say(2, Offer{{}, true});
  s.pass(200);
  EXPECT_EQ(s.did(), "unmirror 2\nclaim [12]\n");
}

TEST(SideMirrors, APeerThatNeverCompletesItsRoundHasHalfAMinute) {
  Mirrors s;
  s.lose(1);
  s.join(2, s.session);
  s.pass(29'999);
  EXPECT_EQ(s.did(), "");
  s.pass(201);
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
}

TEST(SideMirrors, ANewSessionHasMirrorsOfTheOldOneUntilItIsDead) {
  Mirrors s;
  s.lose(1);
  s.pass(1000);
  EXPECT_NE(s.join(2), s.session);  // the client has forgotten its session
  s.say(2, Offer{{channel(1, "/map", {origin(1, 11, latched())})}, true});
  EXPECT_EQ(s.said(2), "demand 1 on\n");  // it feeds the mirror that is there
  s.pass(3000);
  EXPECT_EQ(s.did(), "");
  s.message(2, 1, 1, "a");
  EXPECT_EQ(s.did(), "publish 2 a\n");
}

TEST(SideMirrors, ASilentLinkIsDeadAtOnceAndItsMirrorsToo) {
  Mirrors s;
  s.fall_silent(1);
  s.pass(2999);
  EXPECT_EQ(s.did(), "");
  s.pass(1);
  EXPECT_EQ(s.did(), "close 1 4008\nunmirror 2\nclaim []\n");
}

TEST(SideMirrors, AClientThatSaysGoodbyeTakesItsMirrorsWithIt) {
  Mirrors s;
  s.lose(1, 1001);
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
}

// The old connection seems alive until it has been silent for dead_after.
TEST(SideMirrors, ARestartedClientTakesOverFromItsOldConnection) {
  Script s(server());
  s.graph({topic("/cmd_vel").sub(1)});
  s.pass(1000);
  for (const std::uint32_t n : {1, 2}) {
    s.login(n, {}, {"ops", {}, 0});
    s.said(n);
    s.did();
    s.say(n, Offer{{channel(n, "/cmd_vel", {origin(1, 11)})}, true});
    s.said(n == 1 ? 2 : 1);
  }
  s.message(2, 2, 1, "go", 10);
  EXPECT_EQ(s.did(), "publish 2 go\n");
  s.message(1, 1, 1, "late", 20);
  EXPECT_EQ(s.did(), "");
}

// A claim names all that is mirrored.
TEST(SideMirrors, ClaimsAreToldNowAndThen) {
  Script s(server());
  s.graph({});
  s.pass(1000);
  s.join(1);
  s.say(1, Offer{{channel(1, "/a", {})}, true});
  s.pass(20);
  s.did();
  for (std::uint8_t i = 1; i <= 100; ++i) s.say(1, OriginsChanged{{1}, {origin(i, i)}, {}});
  s.pass(24);
  const std::string did = s.did();
  EXPECT_EQ(times(did, "claim ["), 21);
  EXPECT_NE(did.find(" 99 100]"), std::string::npos) << did;
  s.pass(100);
  s.did();
  s.claims = 0;
  s.pass(1000);
  EXPECT_EQ(s.did(), "");
  EXPECT_LE(s.claims, 1U);  // a sign of life
}

TEST(SideMirrors, BothEndsInOneGraphMirrorNothing) {
  Mirrors s;
  s.claim(9, Script::peer_id(1).bytes[0], {});  // link 1's peer is in our own graph
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
  EXPECT_EQ(s.said(1), "demand 1 off\n");
}

TEST(SideMirrors, OriginsThatComeAndGoTooOftenEndTheLink) {
  SideOptions options = server();
  options.account.ends_per_second = 10;
  Mirrors s(latched(), options);
  std::uint32_t id = 2;
  s.say(1, OriginsChanged{{1}, {origin(id, 12)}, {}});
  for (; id < 1321; ++id) {
    s.say(1, OriginsChanged{{1}, {origin(id + 1, 12)}, {{id}}});
    s.did();
  }
  EXPECT_TRUE(s.status().links.at(0).open);
  for (int i = 0; i < 2; ++i, ++id) s.say(1, OriginsChanged{{1}, {origin(id + 1, 12)}, {{id}}});
  EXPECT_NE(s.did().find("close 1 4006"), std::string::npos);
}

// Its rules may weaken what it offers.
TEST(SideMirrors, AnotherLinksOfferIsFollowedWhenItFeeds) {
  Mirrors s;
  s.message(1, 1, 1, "a", 10);
  s.join(2);
  s.did();
  s.say(2, Offer{{channel(7, "/map", {origin(1, 11, latched(5))})}, true});
  EXPECT_EQ(s.did(), "");
  s.said(2);
  s.say(1, Withdraw{{{1}}});
  EXPECT_EQ(s.did(), "unmirror 2\nmirror 3 /map reliable latched 5\nclaim [11]\n");
  s.pass(250);
  EXPECT_EQ(s.said(2), "demand 7 on\n");
  s.message(2, 7, 1, "a", 10);
  EXPECT_EQ(s.did(), "publish 3 a\n");
}

// The first origin brings the demand; the others follow in the same offer.
TEST(SideMirrors, AfterAReconnectTheSamplesOfEachOriginAreKnown) {
  Mirrors s;
  s.say(1, OriginsChanged{{1}, {origin(2, 12, latched(2))}, {}});
  for (const char* text : {"a", "b"}) s.message(1, 1, 2, text, *text);
  s.lose(1);
  s.join(2, s.session);
  s.did();
  s.say(2,
        Offer{{channel(1, "/map", {origin(1, 11, latched()), origin(2, 12, latched(2))})}, true});
  EXPECT_EQ(s.said(2), "demand 1 on has 2:98\n");
  for (const char* text : {"a", "b", "c"}) s.message(2, 1, 2, text, *text);
  EXPECT_EQ(s.did(), "publish 3 c\n");
}

// ---- subscribers that get nothing

constexpr char kNoName[] = "_NODE_NAME_UNKNOWN_";
TEST(SideMirrors, TellOfASubscriberThatGetsNothingWhenItsNameIsKnown) {
  Mirrors s(best_effort());
  s.did();
  s.logged.clear();
  s.graph({topic("/map").sub(1).sub(2, qos(), kNoName).sub(3, best_effort())});
  s.did();
  EXPECT_EQ(s.logged, "");
  s.graph({topic("/map").sub(1).sub(2, qos(), "rviz").sub(3, best_effort())});
  const std::string told =
      "/map: /rviz requests reliable, and /peer_node on the other side offers best effort (QoS "
      "reliability): it receives nothing from it\n";
  s.did();
  EXPECT_EQ(s.logged, told);
  s.pass(5000);
  s.did();
  EXPECT_EQ(s.logged, told);
}

}  // namespace
}  // namespace connect_bridge::side_test
