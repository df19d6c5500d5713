#include <algorithm>
#include <cstdio>
#include <deque>

#include "core/side/graph_view.hpp"
#include "ros/gateway.hpp"
#include "ros/graph.hpp"
#include "ros/service_fixture.hpp"

namespace connect_bridge::ros {
namespace {

class ServiceGraphTest : public RosTest {
 protected:
  static std::vector<ServiceState> find(const TestSide& side, const std::string& name) {
    std::vector<ServiceState> found;
    for (const ServiceState& state : side.graph.services) {
      if (state.name == name) found.push_back(state);
    }
    return found;
  }
};

TEST_F(ServiceGraphTest, TellsWhoServesWhat) {
  TestNode robot("robot", {"--ros-args", "-r", "__ns:=/fleet"});
  TestSide side("connect_server");
  const std::string action = topic("fib") + "/_action/send_goal";
  const std::string type = std::string{kTestPackage} + "/action/Fibonacci_SendGoal";
  auto server = std::make_unique<RawServer>(robot, topic("service"));
  RawServer hidden(robot, action, type);
  ASSERT_TRUE(side.until(
      [&] { return !find(side, topic("service")).empty() && !find(side, action).empty(); }));
  const auto states = find(side, topic("service"));
  ASSERT_EQ(1u, states.size());
  EXPECT_EQ(kSetBool, states[0].type);
  ASSERT_EQ(1u, states[0].servers.size());
  EXPECT_EQ("/fleet", states[0].servers[0].node_namespace);
  EXPECT_EQ("robot", states[0].servers[0].node_name);
  EXPECT_EQ(type, find(side, action)[0].type);
  server.reset();
  EXPECT_TRUE(side.until([&] { return find(side, topic("service")).empty(); }));
}

// A server that is replaced under the same name and node: only its id tells.
TEST_F(ServiceGraphTest, SeesAServerReplaced) {
  TestNode robot("robot");
  TestSide side("connect_server");
  auto server = std::make_unique<RawServer>(robot, topic("service"));
  side.gateway.apply(Action{CreateServiceClient{ServiceClientId{1}, topic("service"), kSetBool}});
  const auto id = [&] {
    const auto states = find(side, topic("service"));
    return states.empty() ? Gid{} : states[0].servers[0].gid;
  };
  ASSERT_TRUE(side.until([&] { return id() != Gid{}; }));
  const Gid first = id();
  server = nullptr;
  server = std::make_unique<RawServer>(robot, topic("service"));
  EXPECT_TRUE(side.until([&] { return id() != Gid{} && id() != first; }));
}

// Another bridge's proxies are the other bridge to us, whatever their names.
TEST_F(ServiceGraphTest, ProxiesOfOtherBridgesAreNotRobots) {
  TestSide side("connect_server"), other("connect_client");
  other.gateway.apply(Action{CreateMirror{MirrorId{1}, std::string{kClaimsTopic},
                                          "rcl_interfaces/msg/Log", "", qos_of_depth(1)}});
  other.gateway.apply(
      Action{CreateMirror{MirrorId{2}, topic("a"), kString, "", qos_of_depth(1), "/talker"}});
  other.gateway.apply(
      Action{CreateServiceMirror{ServiceMirrorId{1}, topic("service"), kSetBool, "", "/talker"}});
  ASSERT_TRUE(side.topic_state(topic("a"), [](const TopicState& state) {
    return state.publishers.size() == 1 && state.publishers[0].node_name == "connect_client";
  }));
  EXPECT_TRUE(side.until([&] {
    const auto states = find(side, topic("service"));
    return states.size() == 1 && states[0].servers[0].node_name == "connect_client";
  }));
}

// What a killed process of our name has left, proxies included, is nobody's.
TEST_F(ServiceGraphTest, WhatANamesakeHasIsNotThere) {
  TestNode robot("robot");
  TestSide side("connect_server"), left("connect_server");
  left.gateway.apply(Action{CreateMirror{MirrorId{1}, topic("own"), kString, "", qos_of_depth(1)}});
  left.gateway.apply(
      Action{CreateMirror{MirrorId{2}, topic("a"), kString, "", qos_of_depth(1), "/talker"}});
  left.gateway.apply(
      Action{CreateServiceMirror{ServiceMirrorId{1}, topic("service"), kSetBool, "", "/talker"}});
  RawServer marker(robot, topic("marker"));
  RawClient client(robot, topic("service"));
  ASSERT_TRUE(left.until([&] { return client.ready(); }));
  ASSERT_TRUE(side.until([&] { return !find(side, topic("marker")).empty(); }));
  EXPECT_TRUE(side.until(
      [&] { return !side.find_topic(topic("a")) && find(side, topic("service")).empty(); }));
  side.drain_for(300ms);
  EXPECT_FALSE(side.find_topic(topic("a")));
  EXPECT_TRUE(find(side, topic("service")).empty());
}

TEST_F(ServiceGraphTest, LeavesOutClientsAndOurs) {
  TestNode robot("robot");
  TestSide side("connect_server");
  RawClient client(robot, topic("asked"));
  side.gateway.apply(Action{CreateServiceMirror{ServiceMirrorId{1}, topic("asked"), kSetBool, ""}});
  side.gateway.apply(Action{
      CreateServiceMirror{ServiceMirrorId{2}, topic("proxied"), kSetBool, "", "/other/robot"}});
  ASSERT_TRUE(side.until([&] { return client.ready(); }));
  RawServer server(robot, topic("marker"));
  ASSERT_TRUE(side.until([&] { return !find(side, topic("marker")).empty(); }));
  EXPECT_TRUE(find(side, topic("asked")).empty());
  EXPECT_TRUE(find(side, topic("proxied")).empty());
}

TEST_F(ServiceGraphTest, ServersOfOneNameAndTwoTypes) {
  TestNode first("first"), second("second"), third("third");
  TestSide side("connect_server");
  RawServer a(first, topic("service")), b(second, topic("service"));
  RawServer c(third, topic("service"), std::string{kTestPackage} + "/srv/Count");
  EXPECT_TRUE(side.until([&] {
    const auto states = find(side, topic("service"));
    return states.size() == 2 && states[0].servers.size() + states[1].servers.size() == 3;
  }));
}

// What reading the services adds to reading a large graph.
TEST_F(ServiceGraphTest, ManyServicesStayCheap) {
  TestNode robot("robot");
  TestSide side("connect_server");
  std::deque<RawPublisher> publishers;
  std::deque<RawServer> servers;
  for (int i = 0; i < 300; ++i) publishers.emplace_back(robot, topic("t" + std::to_string(i)));
  for (int i = 0; i < 200; ++i) servers.emplace_back(robot, topic("s" + std::to_string(i)));
  const auto count = [&] { return side.graph.services.size(); };
  ASSERT_TRUE(side.until([&] { return count() >= 200 && side.graph.topics.size() >= 300; }, 30s));
  const auto begin = std::chrono::steady_clock::now();
  const auto services = read_services(*side.node, {}, {});
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  ASSERT_TRUE(services);
  EXPECT_GE(services->size(), 200u);
  bool unknown_names = false;
  const auto again = std::chrono::steady_clock::now();
  ASSERT_TRUE(read_graph(*side.node, {}, unknown_names));
  const std::chrono::duration<double, std::milli> whole = std::chrono::steady_clock::now() - again;
  std::printf("[          ] 300 topics, 200 services: %.2f ms, %.2f of them for the services\n",
              whole.count(), took.count());
  EXPECT_LT(took, whole / 2);
}

}  // namespace
}  // namespace connect_bridge::ros
