// Mirrors beside other bridges of the graph: which of them feeds.
#include <gtest/gtest.h>

#include "unit/topics/mirrors_script.hpp"

namespace connect_bridge::side_test {
namespace {

TEST(SideMirrors, AnotherBridgesClaimIsRespected) {
  Mirrors s;
  s.claim(9, 0, {gid(11)}, true);  // the smallest side id, and it feeds as well
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
  EXPECT_EQ(s.said(1), "demand 1 off\n");
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge"), topic("/map").sub(1)});
  s.say(1, OriginsChanged{{1}, {origin(2, 12)}, {}});  // of this one it says nothing
  EXPECT_EQ(s.did(), "mirror 3 /map reliable volatile 10\nclaim [12?]\n");
  s.pass(250);
  EXPECT_EQ(s.did(), "claim [12]\n");
  EXPECT_EQ(s.said(1), "demand 1 on\n");
  s.graph({topic("/map").sub(1)});  // the other bridge is gone
  EXPECT_EQ(s.did(), "mirror 4 /map reliable latched 1\nclaim [11 12]\n");
  EXPECT_EQ(s.said(1), "demand 1 off\n");  // so that the last samples come again
  s.pass(250);
  EXPECT_EQ(s.said(1), "demand 1 on\n");
}

TEST(SideMirrors, ABridgeThatFeedsIsNotDisplacedByASmallerSideThatDoesNot) {
  Mirrors s;
  s.claim(9, 0, {gid(11)});
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.said(1), "");
}

TEST(SideMirrors, OfTwoThatFeedTheLargerGoes) {
  Mirrors s;
  s.claim(9, 255, {gid(11)}, true);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.said(1), "");
  s.claim(8, 0, {gid(11)}, true);
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
  EXPECT_EQ(s.said(1), "demand 1 off\n");
}

TEST(SideMirrors, WhoDoesNotFeedYetGivesWayToALargerSideThatDoes) {
  Mirrors s;
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge"), topic("/map").sub(1)});
  s.say(1, OriginsChanged{{1}, {origin(2, 12), origin(3, 13)}, {}});
  s.pass(20);
  EXPECT_EQ(s.did(),
            "mirror 3 /map reliable volatile 10\nmirror 4 /map reliable volatile 10\n"
            "claim [11 12? 13?]\n");
  s.claim(9, 255, {gid(12)}, true);
  EXPECT_EQ(s.did(), "unmirror 3\nclaim [11 13?]\n");
  s.pass(229);
  EXPECT_EQ(s.did(), "");
  s.pass(1);
  EXPECT_EQ(s.did(), "claim [11 13]\n");
  s.claim(9, 255, {gid(12), gid(13)}, true);  // too late
  EXPECT_EQ(s.did(), "");
}

// The exporter is asked for the last samples again.
TEST(SideMirrors, WhoWaitsForLastSamplesFeedsAllTheSame) {
  Mirrors s;
  s.claim(9, 0, {gid(12)}, true);
  s.say(1, OriginsChanged{{1}, {origin(2, 12, latched())}, {}});
  EXPECT_EQ(s.did(), "");
  s.claim(9, 0, {});
  EXPECT_EQ(s.did(), "mirror 3 /map reliable latched 1\nclaim [11 12]\n");
  EXPECT_EQ(s.said(1), "demand 1 off\n");
  s.claim(9, 0, {gid(11)});
  EXPECT_EQ(s.did(), "");
  s.pass(250);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.said(1), "demand 1 on\n");
}

TEST(SideMirrors, BesideAnotherBridgeANewMirrorWaitsForItsClaim) {
  Mirrors s;
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge"), topic("/map").sub(1)});
  s.say(1, Offer{{channel(3, "/b", {origin(1, 13)})}, false});
  s.graph({topic(kClaimsTopic).pub(9, {}, "bridge"), topic("/map").sub(1), topic("/b").sub(1)});
  s.did();
  s.pass(249);
  EXPECT_EQ(s.said(1), "");
  s.pass(1);
  EXPECT_EQ(s.said(1), "demand 3 on\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
