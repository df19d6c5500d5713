#include "ros/graph/graph_reading.hpp"

#include <algorithm>
#include <set>

#include "ros/ros_fixture.hpp"

namespace connect_bridge::ros {
namespace {

using GraphTest = RosTest;

bool has_publisher(const TopicState& state) {
  return state.publishers.size() == 1;
}

TEST_F(GraphTest, TellsEndpointsWithQos) {
  TestNode robot("robot", {"--ros-args", "-r", "__ns:=/fleet"});
  TestSide side("connect_server");
  Qos qos = qos_of_depth(4);
  qos.reliability = Reliability::kBestEffort;
  qos.deadline = 250ms;
  qos.lifespan = 2s;
  qos.liveliness = Liveliness::kManualByTopic;
  qos.liveliness_lease = 3s;
  RawPublisher publisher(robot, topic("_hidden"), qos);
  RawSubscription subscription(robot, topic("_hidden"));
  const auto state = side.topic_state(topic("_hidden"), [](const TopicState& topic_state) {
    return has_publisher(topic_state) && topic_state.subscribers.size() == 1 &&
           topic_state.publishers[0].node_name == "robot";
  });
  ASSERT_TRUE(state);
  EXPECT_EQ(kString, state->type);
  const Endpoint& endpoint = state->publishers[0];
  EXPECT_EQ("/fleet", endpoint.node_namespace);
  EXPECT_EQ(publisher.gid(), endpoint.gid);
  EXPECT_EQ(Reliability::kBestEffort, endpoint.qos.reliability);
  EXPECT_EQ(Durability::kVolatile, endpoint.qos.durability);
  EXPECT_EQ(Duration{250ms}, endpoint.qos.deadline);
  EXPECT_EQ(Duration{2s}, endpoint.qos.lifespan);
  EXPECT_EQ(Liveliness::kManualByTopic, endpoint.qos.liveliness);
  EXPECT_EQ(Duration{3s}, endpoint.qos.liveliness_lease);
  const Qos& other = state->subscribers[0].qos;
  EXPECT_EQ(Reliability::kReliable, other.reliability);
  EXPECT_EQ(kForever, other.deadline);
  EXPECT_EQ(kForever, other.lifespan);
  EXPECT_EQ(kForever, other.liveliness_lease);
}

TEST_F(GraphTest, LeavesOutItsOwnEndpoints) {
  TestNode robot("robot");
  TestSide side("connect_server");
  RawPublisher publisher(robot, topic("a"));
  side.gateway.apply(
      CreateSubscription{SubscriptionId{1}, topic("a"), kString, "", qos_of_depth(1)});
  side.gateway.apply(CreateMirror{MirrorId{1}, topic("a"), kString, "", qos_of_depth(1)});
  side.gateway.apply(CreateMirror{MirrorId{2}, topic("b"), kString, "", qos_of_depth(1)});
  const auto state = side.topic_state(topic("a"), has_publisher);
  ASSERT_TRUE(state);
  side.drain_for(300ms);
  ASSERT_TRUE(side.find_topic(topic("a")));
  EXPECT_EQ(1u, side.find_topic(topic("a"))->publishers.size());
  EXPECT_EQ(0u, side.find_topic(topic("a"))->subscribers.size());
  EXPECT_FALSE(side.find_topic(topic("b")));
  // /rosout is the robot's, not ours.
  const auto rosout = side.find_topic("/rosout");
  ASSERT_TRUE(rosout);
  for (const Endpoint& endpoint : rosout->publishers) {
    EXPECT_NE("connect_server", endpoint.node_name);
  }
}

// The middleware tells the topics of one of them.
TEST_F(GraphTest, TellsTheTopicsOfAllNodesOfAName) {
  TestNode robot("robot"), namesake("robot");
  TestSide side("connect_server");
  for (std::uint32_t n = 1; n <= 50; ++n)
    side.gateway.apply(
        CreateMirror{MirrorId{n}, topic("ours" + std::to_string(n)), kString, "", qos_of_depth(1)});
  RawPublisher one(robot, topic("a"));
  RawPublisher other(namesake, topic("b"));
  EXPECT_TRUE(side.topic_state(topic("a"), has_publisher));
  EXPECT_TRUE(side.topic_state(topic("b"), has_publisher));
  EXPECT_FALSE(side.find_topic(topic("ours1")));
}

// One of two nodes of a name has topics that no node is said to have.
TEST_F(GraphTest, OfTheRestWhatIsNewIsReadFirst) {
  TestNode robot("robot"), namesake("robot");
  TestSide side("connect_server");
  for (std::uint32_t n = 1; n <= 50; ++n)
    side.gateway.apply(
        CreateMirror{MirrorId{n}, topic("ours" + std::to_string(n)), kString, "", qos_of_depth(1)});
  RawPublisher one(robot, topic("one"));
  RawPublisher other(namesake, topic("other"));
  ASSERT_TRUE(side.topic_state(topic("one"), has_publisher));
  ASSERT_TRUE(side.topic_state(topic("other"), has_publisher));
  GraphReading reading(*side.node, Duration::zero());
  const auto read = [&](bool changed) {
    const auto graph = reading.read({}, changed);
    std::set<std::string> names;
    if (graph)
      for (const TopicState& state : graph->topics) names.insert(state.name);
    return names;
  };
  int readings = 0;
  const auto read_all = [&] {
    auto names = read(true);
    for (readings = 1; reading.unfinished(); ++readings) names = read(false);
    return names;
  };
  read_all();
  EXPECT_GE(readings, 50) << "each has one topic of the rest";
  auto a = std::make_unique<RawPublisher>(robot, topic("a"));
  auto b = std::make_unique<RawPublisher>(namesake, topic("b"));
  const auto counted = [&](const std::string& name) {
    std::size_t count = 0;
    EXPECT_EQ(RCL_RET_OK, rcl_count_publishers(side.node->handle(), name.c_str(), &count));
    return count;
  };
  ASSERT_TRUE(side.until([&] { return counted(topic("a")) + counted(topic("b")) == 2; }));
  read(true);
  auto names = read(false);  // the first of the two is not known to be of a node yet, perhaps
  EXPECT_TRUE(names.contains(topic("a")));
  EXPECT_TRUE(names.contains(topic("b")));
  EXPECT_TRUE(reading.unfinished());
  // Their ends are seen at once, and what is left of the rest is read in the end.
  a = nullptr;
  b = nullptr;
  ASSERT_TRUE(side.until([&] { return counted(topic("a")) + counted(topic("b")) == 0; }));
  names = read(true);
  EXPECT_FALSE(names.contains(topic("a")));
  EXPECT_FALSE(names.contains(topic("b")));
  read_all();
  EXPECT_FALSE(read(false).contains(topic("ours1")));
}

TEST_F(GraphTest, SeesAPublisherReplacedUnderTheSameName) {
  TestNode robot("robot");
  TestSide side("connect_server");
  auto publisher = std::make_unique<RawPublisher>(robot, topic("a"));
  const auto first = side.topic_state(topic("a"), has_publisher);
  ASSERT_TRUE(first);
  publisher = nullptr;
  publisher = std::make_unique<RawPublisher>(robot, topic("a"));
  const Gid replaced = publisher->gid();
  ASSERT_NE(first->publishers[0].gid, replaced);
  const auto second = side.topic_state(topic("a"), [&](const TopicState& state) {
    return has_publisher(state) && state.publishers[0].gid == replaced;
  });
  EXPECT_TRUE(second);
  publisher = nullptr;
  EXPECT_TRUE(side.until([&] { return !side.find_topic(topic("a")); }));
}

TEST_F(GraphTest, TwoTypesOnOneTopicAreTwoStates) {
  TestNode robot("robot");
  TestNode second("second");
  TestSide side("connect_server");
  RawPublisher a(robot, topic("a"));
  RawPublisher b(second, topic("a"), qos_of_depth(1), "std_msgs/msg/Int32");
  const auto types = [&] {
    std::vector<std::string> found;
    for (const TopicState& state : side.graph.topics) {
      if (state.name == topic("a")) found.push_back(state.type);
    }
    std::sort(found.begin(), found.end());
    return found;
  };
  const std::vector<std::string> expected{"std_msgs/msg/Int32", "std_msgs/msg/String"};
  EXPECT_TRUE(side.until([&] { return types() == expected; }));
}

TEST_F(GraphTest, ReportsOnlyChangesUnlessAsked) {
  TestNode robot("robot");
  TestSide side("connect_server");
  ASSERT_TRUE(side.until([&] { return side.find_topic("/rosout").has_value(); }));
  int before = 0;
  do {  // until the other node is known as a whole
    before = side.graphs;
    side.drain_for(500ms);
  } while (before != side.graphs);
  // Our own entities change the graph for others only.
  side.gateway.apply(CreateMirror{MirrorId{1}, topic("a"), kString, "", qos_of_depth(1)});
  side.drain_for(300ms);
  EXPECT_EQ(before, side.graphs);
  side.gateway.apply(RefreshGraph{});
  EXPECT_TRUE(side.until([&] { return side.graphs > before; }));
}

// As in a large graph, whose readings are far apart.
TEST_F(GraphTest, ATopicThatIsAskedForIsReadAlone) {
  TestNode robot("robot");
  GatewayOptions options;
  options.graph_pause = std::chrono::hours(1);
  TestSide side("connect_server", options);
  ASSERT_TRUE(side.until([&] { return side.graphs == 1; }));
  auto publisher = std::make_unique<RawPublisher>(robot, topic("a"));
  RawPublisher other(robot, topic("b"));
  const auto asked = [&](bool there) {
    side.gateway.apply(RefreshGraph{topic("a")});
    return side.find_topic(topic("a")).has_value() == there;
  };
  EXPECT_TRUE(side.until([&] { return asked(true); }));
  EXPECT_FALSE(side.find_topic(topic("b")));
  publisher = nullptr;
  EXPECT_TRUE(side.until([&] { return asked(false); }));
  EXPECT_EQ(1U, side.gateway.counters().graph_readings);
}

TEST_F(GraphTest, ALargeGraphStaysCheap) {
  TestNode robot("robot");
  GatewayOptions options;
  TestSide side("connect_server", options);
  std::deque<RawPublisher> publishers;
  const std::size_t topics = 300;
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < topics; ++i) {
    publishers.emplace_back(robot, topic("many_" + std::to_string(i)));
    if (i % 50 == 0) side.drain_for(1ms);
  }
  EXPECT_TRUE(side.until([&] { return side.graph.topics.size() >= topics; }, 30s));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  side.drain_for(100ms);
  const auto counters = side.gateway.counters();
  const double milliseconds = static_cast<double>(counters.graph_reading.count()) / 1e6;
  std::printf("[          ] %zu topics: one reading %.2f ms, %llu readings in %.2f s\n", topics,
              milliseconds, static_cast<unsigned long long>(counters.graph_readings), took.count());
  // 20 ms apart at the most often.
  EXPECT_LE(static_cast<double>(counters.graph_readings), 10 + took.count() / 0.02);
}

}  // namespace
}  // namespace connect_bridge::ros
