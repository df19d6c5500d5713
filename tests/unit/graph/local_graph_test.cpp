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
