// Mirrors beside other bridges of the graph: which of them feeds.
#include <gtest/gtest.h>

#include "unit/mirrors/mirrors_script.hpp"

namespace connect_bridge::side_test {
namespace {

const Topic kBridge = topic(kClaimsTopic).pub(9, {}, "bridge");

TEST(SideMirrors, WhoClaimsFirstKeepsIt) {
  Mirrors s;
  s.claim(9, 0, {gid(12)});
  s.say(1, OriginsChanged{{1}, {origin(2, 12)}, {}});
  s.pass(1000);
  EXPECT_EQ(s.did(), "");
  s.claim(9, 0, {});
  EXPECT_EQ(s.did(), "claim [11 12]\n");
  s.pass(250);
  EXPECT_EQ(s.did(), "mirror 3 /map reliable volatile 10\n");
}

TEST(SideMirrors, OfTwoThatClaimAtOnceTheSmallerSideIdMirrors) {
  Mirrors s;
  s.claim(9, 255, {gid(11)});  // it is the one to give way
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.said(1), "");
  s.claim(9, 0, {gid(11)});
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
  EXPECT_EQ(s.said(1), "demand 1 off\n");
}

TEST(SideMirrors, BesideAnotherBridgeClaimsHaveTimeToCross) {
  Mirrors s;
  s.graph({kBridge, topic("/map").sub(1)});
  s.say(1, OriginsChanged{{1}, {origin(2, 12), origin(3, 13)}, {}});
  EXPECT_EQ(s.did(), "claim [11 12 13]\n");
  s.claim(9, 0, {gid(12)});
  EXPECT_EQ(s.did(), "claim [11 13]\n");
  s.pass(249);
  EXPECT_EQ(s.did(), "");
  s.pass(1);
  EXPECT_EQ(s.did(), "mirror 3 /map reliable volatile 10\n");
}

TEST(SideMirrors, WhenTheOtherBridgeHasGoneItsOriginsAreTakenOver) {
  Mirrors s;
  s.graph({kBridge, topic("/map").sub(1)});
  s.claim(9, 0, {gid(12)});
  s.say(1, OriginsChanged{{1}, {origin(2, 12)}, {}});
  EXPECT_EQ(s.did(), "");
  s.graph({topic("/map").sub(1)});
  EXPECT_EQ(s.did(), "mirror 3 /map reliable volatile 10\nclaim [11 12]\n");
}

// The channel is demanded already: the exporter is asked for the last samples again.
TEST(SideMirrors, WhoTakesOverGetsTheLastSamples) {
  Mirrors s;
  s.claim(9, 0, {gid(12)});
  s.say(1, OriginsChanged{{1}, {origin(2, 12, latched())}, {}});
  s.claim(9, 0, {});
  s.pass(250);
  EXPECT_EQ(s.did(), "claim [11 12]\nmirror 3 /map reliable latched 1\n");
  EXPECT_EQ(s.said(1), "demand 1 off\n");
  s.pass(250);
  EXPECT_EQ(s.said(1), "demand 1 on\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
