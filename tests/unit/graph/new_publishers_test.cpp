// Which publishers do not count yet, beside another bridge.
#include "core/graph/new_publishers.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "core/graph/graph_view.hpp"
#include "unit/side/words.hpp"

namespace connect_bridge::side_test {
namespace {

const Topic kBridge = topic(kClaimsTopic).pub(9, {}, "bridge");

// A publisher of /a whose node the graph does not tell yet.
Topic unnamed(std::uint8_t n) {
  Topic result = topic("/a");
  result.publishers.push_back({gid(n), "", "", {}});
  return result;
}

struct Holds {
  // The publishers that count in this picture, beside those of bridges' claims: "1 2".
  std::string see(const std::vector<Topic>& topics, std::int64_t at) {
    GraphChanged graph;
    for (const auto& each : topics) graph.topics.push_back(each);
    subject.hold(graph, flow_test::now_ms(at));
    std::string counting;
    for (const TopicState& state : graph.topics)
      for (const Endpoint& publisher : state.publishers)
        if (state.name != kClaimsTopic) add(counting, publisher);
    return counting;
  }
  // What counts from then on: "/a 1", "/a 1 left".
  std::string due(std::int64_t at) {
    std::string words;
    const auto taken = subject.take_due(flow_test::now_ms(at));
    for (const TopicState& state : taken.topics) {
      words += (words.empty() ? "" : ", ") + state.name;
      for (const Endpoint& publisher : state.publishers) {
        add(words, publisher);
        if (taken.left.contains(publisher.gid)) words += " left";
      }
    }
    return words;
  }
  static void add(std::string& line, const Endpoint& publisher) {
    line += (line.empty() ? "" : " ") + std::to_string(publisher.gid.bytes[0]);
  }
  [[nodiscard]] std::string held() const {
    return list_of(subject.held(), [](const Gid& id) { return id.bytes[0]; });
  }
  // In milliseconds; -1: none.
  [[nodiscard]] std::int64_t deadline() const {
    const auto at = subject.deadline();
    return at ? (*at - TimePoint{}) / std::chrono::milliseconds(1) : -1;
  }

  NewPublishers subject;
};

TEST(NewPublishers, WithoutAnotherBridgeNobodyWaits) {
  Holds s;
  EXPECT_EQ(s.see({topic("/a").pub(1), topic("/b").pub(2)}, 0), "1 2");
  EXPECT_EQ(s.deadline(), -1);
  EXPECT_EQ(s.due(10'000), "");
}

TEST(NewPublishers, BesideABridgeTheyCountAfterItHadTimeToClaimThem) {
  Holds s;
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(1)}, 0), "");
  EXPECT_EQ(s.held(), "1");
  EXPECT_EQ(s.deadline(), 150);
  EXPECT_EQ(s.due(149), "");
  EXPECT_EQ(s.due(150), "/a 1");
  EXPECT_EQ(s.held(), "");
  EXPECT_EQ(s.deadline(), -1);
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(1)}, 151), "1");
}

TEST(NewPublishers, MorePicturesMakeItNoLater) {
  Holds s;
  for (const int at : {0, 50, 100}) EXPECT_EQ(s.see({kBridge, topic("/a").pub(1)}, at), "") << at;
  EXPECT_EQ(s.held(), "1");
  EXPECT_EQ(s.deadline(), 150);
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(1)}, 200), "1");
  EXPECT_EQ(s.due(10'000), "");  // nor does it count twice
}

TEST(NewPublishers, OneWithoutANodesNameWaitsForThatAndNoLongerThanItsSamples) {
  Holds s;
  EXPECT_EQ(s.see({kBridge, unnamed(1)}, 0), "");
  EXPECT_GT(s.deadline(), 150);
  EXPECT_LT(s.deadline(), 1000);  // ParkedSamples::kTime
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(1)}, 100), "");
  EXPECT_EQ(s.deadline(), 150);  // it has its name
}

// Its samples would stop for a moment.
TEST(NewPublishers, WhoCountedBeforeABridgeCameGoesOn) {
  Holds s;
  EXPECT_EQ(s.see({topic("/a").pub(1)}, 0), "1");
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(1).pub(2)}, 10), "1");
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(1).pub(2)}, 20), "1");
  EXPECT_EQ(s.due(160), "/a 2");
}

// What it has published is still to cross.
TEST(NewPublishers, WhoLeavesMeanwhileCountsAllTheSame) {
  Holds s;
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(1).pub(2)}, 0), "");
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(2)}, 50), "");
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(2)}, 100), "");
  EXPECT_EQ(s.due(149), "");
  const std::string due = s.due(150);
  EXPECT_NE(due.find("/a 1 left"), std::string::npos) << due;
  EXPECT_EQ(due.find("2 left"), std::string::npos) << due;
  EXPECT_EQ(s.due(10'000), "");
}

TEST(NewPublishers, WhoComesBackIsHeldOnce) {
  Holds s;
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(1)}, 0), "");
  EXPECT_EQ(s.see({kBridge}, 50), "");
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(1)}, 100), "");
  EXPECT_EQ(s.held(), "1");
  EXPECT_EQ(s.due(10'000), "/a 1");
}

// They are known as such at once, and GraphView leaves them out.
TEST(NewPublishers, ABridgesOwnAreNotHeld) {
  Holds s;
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(5, {}, "bridge")}, 0), "5");
  EXPECT_EQ(s.deadline(), -1);
}

// Then a bridge's mirrors are known by their ids.
TEST(NewPublishers, WhereIdsShowTheProcessNobodyWaits) {
  Holds s;
  Topic other = topic("/b");
  Gid same_process = gid(2);
  same_process.bytes[20] = 1;
  other.subscribers.push_back({same_process, "/", "n2", {}});
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(1).sub(2)}, 0), "");
  EXPECT_EQ(s.see({kBridge, topic("/a").pub(3).sub(2), other}, 10), "3");
}

}  // namespace
}  // namespace connect_bridge::side_test
