// The local graph in step with what other bridges claim.
#include "core/graph/local_graph.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "unit/side/words.hpp"

namespace connect_bridge::side_test {
namespace {

Token128 side_of(std::uint8_t n) {
  Token128 result;
  result.bytes.fill(n);
  return result;
}

// Another bridge of this graph, whose claims publisher 9 brings.
const Topic kOtherBridge = topic(kClaimsTopic).pub(9, {}, "bridge");

// A publisher of /a whose node the graph does not tell yet.
Topic unnamed(std::uint8_t n) {
  Topic result = topic("/a");
  result.publishers.push_back({gid(n), "", "", {}});
  return result;
}

// Time in milliseconds.
struct Watched {
  void see(const std::vector<Topic>& topics, std::int64_t at = 0) {
    GraphChanged graph;
    for (const auto& each : topics) graph.topics.push_back(each);
    subject.update(std::move(graph), flow_test::now_ms(at));
  }
  bool release(std::int64_t at) { return subject.release(flow_test::now_ms(at)); }
  void claim(const Claim& claim) {
    static_cast<void>(subject.claims.update(gid(9), claim, flow_test::now_ms(0).steady));
  }
  // The publishers of /a that are in the view.
  [[nodiscard]] std::string publishers() const {
    const TopicState* state = subject.view.find({"/a", kType});
    return state ? list_of(state->publishers, [](const Endpoint& e) { return e.gid.bytes[0]; })
                 : "";
  }
  // -1: none.
  [[nodiscard]] std::int64_t deadline() const {
    const auto at = subject.deadline();
    return at ? (*at - TimePoint{}) / std::chrono::milliseconds(1) : -1;
  }

  LocalGraph subject{side_of(5)};
};

TEST(LocalGraph, AloneItIsWhatThePictureShows) {
  Watched s;
  EXPECT_EQ(s.deadline(), -1);
  s.see({topic("/a").pub(1).pub(2)});
  EXPECT_EQ(s.publishers(), "1 2");
  EXPECT_FALSE(s.release(10'000));
  EXPECT_EQ(s.deadline(), -1);
  s.see({topic("/a").pub(2)}, 100);
  EXPECT_EQ(s.publishers(), "2");
}

// It may be the other one's mirror; but nobody mirrors it here meanwhile.
TEST(LocalGraph, BesideABridgeANewPublisherIsKnownAtOnceAndSeenLater) {
  Watched s;
  s.see({kOtherBridge, topic("/a").pub(1)});
  EXPECT_EQ(s.publishers(), "");
  EXPECT_TRUE(s.subject.view.is_local(gid(1)));
  EXPECT_EQ(s.deadline(), 150);
  EXPECT_FALSE(s.release(149));
  EXPECT_TRUE(s.release(150));
  EXPECT_EQ(s.publishers(), "1");
  EXPECT_FALSE(s.release(150));
  EXPECT_EQ(s.deadline(), -1);
  s.see({kOtherBridge, topic("/a").pub(1)}, 151);
  EXPECT_EQ(s.publishers(), "1");
}

TEST(LocalGraph, MorePicturesMakeItNoLater) {
  Watched s;
  for (const int at : {0, 50, 100}) s.see({kOtherBridge, topic("/a").pub(1)}, at);
  EXPECT_EQ(s.publishers(), "");
  EXPECT_EQ(s.deadline(), 150);
  s.see({kOtherBridge, topic("/a").pub(1)}, 200);
  EXPECT_EQ(s.publishers(), "1");
  EXPECT_FALSE(s.release(10'000));  // nor does it count twice
}

TEST(LocalGraph, OneWithoutANodesNameWaitsForThatAndNoLongerThanItsSamples) {
  Watched s;
  s.see({kOtherBridge, unnamed(1)});
  EXPECT_EQ(s.publishers(), "");
  EXPECT_GT(s.deadline(), 150);
  EXPECT_LT(s.deadline(), 1000);  // ParkedSamples::kTime
  s.see({kOtherBridge, topic("/a").pub(1)}, 100);
  EXPECT_EQ(s.publishers(), "");
  EXPECT_EQ(s.deadline(), 150);  // it has its name
}

// Its samples would stop for a moment.
TEST(LocalGraph, WhoCountedBeforeABridgeCameGoesOn) {
  Watched s;
  s.see({topic("/a").pub(1)});
  for (const int at : {10, 20}) {
    s.see({kOtherBridge, topic("/a").pub(1).pub(2)}, at);
    EXPECT_EQ(s.publishers(), "1");
  }
  EXPECT_TRUE(s.release(160));
  EXPECT_EQ(s.publishers(), "1 2");
}

TEST(LocalGraph, WhoLeavesMeanwhileCountsAllTheSame) {
  Watched s;
  s.see({kOtherBridge, topic("/a").pub(1).pub(2)});
  for (const int at : {50, 100}) s.see({kOtherBridge, topic("/a").pub(2)}, at);
  EXPECT_FALSE(s.release(149));
  EXPECT_TRUE(s.release(150));
  EXPECT_EQ(s.publishers(), "2 1");
  EXPECT_TRUE(s.release(150));
  EXPECT_EQ(s.publishers(), "2");
  EXPECT_FALSE(s.release(10'000));
}

TEST(LocalGraph, WhoComesBackIsHeldOnce) {
  Watched s;
  s.see({kOtherBridge, topic("/a").pub(1)});
  s.see({kOtherBridge}, 50);
  s.see({kOtherBridge, topic("/a").pub(1)}, 100);
  EXPECT_EQ(s.publishers(), "");
  EXPECT_TRUE(s.release(10'000));
  EXPECT_EQ(s.publishers(), "1");
  EXPECT_FALSE(s.release(10'000));
}

// They are known as such at once.
TEST(LocalGraph, ABridgesOwnAreNotHeld) {
  Watched s;
  s.see({kOtherBridge, topic("/a").pub(5, {}, "bridge")});
  EXPECT_EQ(s.publishers(), "");
  EXPECT_EQ(s.deadline(), -1);
}

// Then a bridge's mirrors are known by their ids.
TEST(LocalGraph, WhereIdsShowTheProcessNobodyWaits) {
  Watched s;
  Topic other = topic("/b");
  Gid same_process = gid(2);
  same_process.bytes[20] = 1;
  other.subscribers.push_back({same_process, "/", "n2", {}});
  s.see({kOtherBridge, topic("/a").pub(1).sub(2)});
  EXPECT_EQ(s.publishers(), "");
  s.see({kOtherBridge, topic("/a").pub(3).sub(2), other}, 10);
  EXPECT_EQ(s.publishers(), "3");
}

// So that what it has said crosses.
TEST(LocalGraph, APublisherThatHasLeftMeanwhileIsSeenForAMoment) {
  for (const bool picture_between : {false, true}) {
    Watched s;
    s.see({kOtherBridge, topic("/a").pub(1)});
    s.see({kOtherBridge}, 50);
    EXPECT_TRUE(s.release(150));
    EXPECT_EQ(s.publishers(), "1");
    if (picture_between) s.see({kOtherBridge}, 150);
    EXPECT_EQ(s.release(150), !picture_between);
    EXPECT_EQ(s.publishers(), "");
    EXPECT_FALSE(s.subject.view.is_local(gid(1)));
    EXPECT_FALSE(s.release(150));
  }
}

TEST(LocalGraph, WhatIsClaimedAsAMirrorIsNoPublisher) {
  Watched s;
  s.see({topic("/a").pub(1).pub(2)});
  s.claim({side_of(4), {}, {gid(1)}});
  EXPECT_TRUE(s.subject.on_claims());
  EXPECT_EQ(s.publishers(), "2");
  EXPECT_FALSE(s.subject.view.is_local(gid(1)));
  EXPECT_FALSE(s.subject.on_claims());
  s.see({topic("/a").pub(1).pub(2)}, 100);
  EXPECT_EQ(s.publishers(), "2");
}

TEST(LocalGraph, ABridgesClaimsEndWhenItLeavesTheGraph) {
  Watched s;
  s.claim({side_of(4), {gid(1)}});
  s.see({});  // which does not show it yet
  EXPECT_TRUE(s.subject.claims.taken(gid(1), false));
  s.see({kOtherBridge}, 100);
  EXPECT_TRUE(s.subject.claims.taken(gid(1), false));
  s.see({}, 200);
  EXPECT_FALSE(s.subject.claims.taken(gid(1), false));
}

}  // namespace
}  // namespace connect_bridge::side_test
