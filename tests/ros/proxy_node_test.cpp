#include <rcl/graph.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "core/graph/graph_view.hpp"
#include "ros/gateway.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/service_fixture.hpp"

namespace connect_bridge::ros {
namespace {

class ProxyNodeTest : public RosTest {
 protected:
  void mirror(TestSide& side, std::uint32_t id, const std::string& name, const std::string& node) {
    side.gateway.apply(CreateMirror{MirrorId{id}, topic(name), kString, "", qos_of_depth(1), node});
  }
  static bool sees_node(Node& from, const std::string& name) {
    auto names = rcutils_get_zero_initialized_string_array();
    auto spaces = rcutils_get_zero_initialized_string_array();
    EXPECT_EQ(RCL_RET_OK,
              rcl_get_node_names(from.handle(), rcl_get_default_allocator(), &names, &spaces));
    bool seen = false;
    for (std::size_t i = 0; i < names.size; ++i) {
      const std::string space = spaces.data[i];
      seen = seen || (space == "/" ? "" : space) + "/" + names.data[i] == name;
    }
    EXPECT_EQ(RCUTILS_RET_OK, rcutils_string_array_fini(&names));
    EXPECT_EQ(RCUTILS_RET_OK, rcutils_string_array_fini(&spaces));
    return seen;
  }
};

TEST_F(ProxyNodeTest, LivesAsLongAsSomethingOfIt) {
  TestNode user("user");
  TestSide side("connect_client"), observer("observer");
  mirror(side, 1, "a", "/fleet/talker");
  mirror(side, 2, "b", "/fleet/talker");
  side.gateway.apply(
      CreateServiceMirror{ServiceMirrorId{1}, topic("service"), kSetBool, "", "/fleet/talker"});
  EXPECT_EQ(1u, side.gateway.counters().proxy_nodes);
  const auto state = observer.topic_state(topic("a"), [](const TopicState& topic_state) {
    return topic_state.publishers.size() == 1 && topic_state.publishers[0].node_name == "talker";
  });
  ASSERT_TRUE(state);
  EXPECT_EQ("/fleet", state->publishers[0].node_namespace);
  EXPECT_TRUE(side.until([&] { return sees_node(*user, "/fleet/talker"); }));
  RawClient client(user, topic("service"));
  ASSERT_TRUE(side.until([&] { return client.ready(); }));
  side.gateway.apply(DestroyMirror{MirrorId{1}});
  side.gateway.apply(DestroyMirror{MirrorId{2}});
  EXPECT_EQ(1u, side.gateway.counters().proxy_nodes);
  client.send(set_bool(true));
  EXPECT_TRUE(side.next<RequestTaken>());
  side.gateway.apply(DestroyServiceMirror{ServiceMirrorId{1}});
  EXPECT_TRUE(side.until([&] { return side.gateway.counters().proxy_nodes == 0; }));
  EXPECT_TRUE(side.until([&] { return !sees_node(*user, "/fleet/talker"); }));
  // A proxy's log would publish our log a second time.
  EXPECT_FALSE(side.find_topic("/fleet/talker/rosout"));
}

TEST_F(ProxyNodeTest, IsNoNodeOfOthersToUs) {
  TestNode user("user");
  TestSide side("connect_client");
  mirror(side, 1, "a", "/talker");
  RawPublisher marker(user, topic("marker"));
  ASSERT_TRUE(side.topic_state(topic("marker"), [](const TopicState&) { return true; }));
  EXPECT_FALSE(side.find_topic(topic("a")));
}

// The peer chooses the names, so a proxy must not impersonate a node here.
TEST_F(ProxyNodeTest, NeverHasTheNameOfANodeThatIsHere) {
  TestNode planner("planner", {"--ros-args", "-r", "__ns:=/fleet"});
  TestSide side("connect_client"), observer("observer");
  RawPublisher plan(planner, topic("plan"));
  ASSERT_TRUE(side.topic_state(topic("plan"), [](const TopicState& state) {
    return state.publishers.size() == 1 && state.publishers[0].node_name == "planner";
  }));
  mirror(side, 1, "a", "/fleet/planner");
  mirror(side, 2, "b", "/planner");
  EXPECT_EQ(1u, side.gateway.counters().proxy_nodes);
  EXPECT_TRUE(observer.topic_state(topic("a"), [](const TopicState& state) {
    return state.publishers.size() == 1 && state.publishers[0].node_name == "connect_client";
  }));
  EXPECT_TRUE(observer.topic_state(topic("b"), [](const TopicState& state) {
    return state.publishers.size() == 1 && state.publishers[0].node_name == "planner";
  }));
}

// A bridge that was killed leaves its proxies in the graph for a while, and another one may have
// made the same: neither prevents us from making ours.
TEST_F(ProxyNodeTest, ProxiesOfOtherBridgesAreNobody) {
  if (!middleware().tells_servers()) GTEST_SKIP() << "ids do not show the process: claims tell it";
  TestSide left("connect_client"), other("connect_other"), side("connect_client");
  other.gateway.apply(CreateMirror{MirrorId{1}, std::string{kClaimsTopic}, "rcl_interfaces/msg/Log",
                                   "", qos_of_depth(1)});
  mirror(left, 1, "a", "/talker");
  mirror(other, 2, "b", "/singer");
  TestNode user("user");
  RawPublisher marker(user, topic("marker"));
  ASSERT_TRUE(side.topic_state(topic("b"), [](const TopicState& state) {
    return state.publishers.size() == 1 && state.publishers[0].node_name == "connect_other";
  }));
  ASSERT_TRUE(side.until([&] { return sees_node(*side.node, "/talker"); }));
  ASSERT_TRUE(side.topic_state(topic("marker"), [](const TopicState&) { return true; }));
  mirror(side, 1, "c", "/talker");
  mirror(side, 2, "d", "/singer");
  EXPECT_EQ(2u, side.gateway.counters().proxy_nodes);
}

TEST_F(ProxyNodeTest, RemapsOfOursAreNotTheirs) {
  TestNode user("user");
  TestSide side("connect_client", {}, {"--ros-args", "-r", "__node:=ours", "-r", "__ns:=/we"});
  mirror(side, 1, "a", "/talker");
  EXPECT_TRUE(side.until([&] { return sees_node(*user, "/talker"); }));
  EXPECT_TRUE(side.until([&] { return sees_node(*user, "/we/ours"); }));
}

TEST_F(ProxyNodeTest, NamesThatAreNoneBecomeOurs) {
  TestNode user("user");
  TestSide side("connect_client"), observer("observer");
  std::uint32_t id = 0;
  for (const char* name : {"talker", "/", "/a//b", "/1st", "/with space", "/~"}) {
    ++id;
    mirror(side, id, "t" + std::to_string(id), name);
    const auto state =
        observer.topic_state(topic("t" + std::to_string(id)), [](const TopicState& topic_state) {
          return topic_state.publishers.size() == 1 &&
                 topic_state.publishers[0].node_name == "connect_client";
        });
    EXPECT_TRUE(state) << name;
  }
  EXPECT_EQ(0u, side.gateway.counters().proxy_nodes);
  EXPECT_FALSE(side.next<MirrorFailed>(0ms));
}

// For the documents: what one costs.
TEST_F(ProxyNodeTest, CostsLittle) {
  TestSide side("connect_client");
  const std::uint32_t count = 200;
  std::uint32_t id = 0;
  const auto cost = [&](const std::string& prefix) {
    const std::size_t memory = resident_kilobytes();
    const auto begin = std::chrono::steady_clock::now();
    for (std::uint32_t i = 0; i < count; ++i) {
      ++id;
      const std::string number = std::to_string(id);
      mirror(side, id, "t" + number, prefix.empty() ? prefix : prefix + number);
    }
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    return std::pair{took.count() / count, (resident_kilobytes() - memory) / double{count}};
  };
  cost("");  // the first ones make what all share
  const std::size_t before = threads();
  const auto bare = cost("");
  const auto with = cost("/node_");
  std::printf(
      "[          ] a publisher: %.3f ms, %.0f kB; with a proxy of its own: %.3f ms, %.0f kB\n",
      bare.first, bare.second, with.first, with.second);
  EXPECT_EQ(before, threads());
  EXPECT_EQ(count, side.gateway.counters().proxy_nodes);
  EXPECT_LT(with.first, 20.0);
}

}  // namespace
}  // namespace connect_bridge::ros
