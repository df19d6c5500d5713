#include <algorithm>
#include <atomic>
#include <cstdio>
#include <deque>
#include <set>
#include <thread>

#include "core/graph/graph_view.hpp"
#include "ros/gateway.hpp"
#include "ros/graph/graph_reading.hpp"
#include "ros/graph/service_reading.hpp"
#include "ros/node/proxy_nodes.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/service_fixture.hpp"
#include "ros/services/service_mirror.hpp"

namespace connect_bridge::ros {
namespace {

constexpr char kNoIds[] = "servers have no ids with this middleware";

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

// A server that is replaced under the same name and node: only its id shows it.
TEST_F(ServiceGraphTest, SeesAServerReplaced) {
  if (!middleware().tells_servers()) GTEST_SKIP() << kNoIds;
  TestNode robot("robot");
  TestSide side("connect_server");
  auto server = std::make_unique<RawServer>(robot, topic("service"));
  side.gateway.apply(CreateServiceClient{ServiceClientId{1}, topic("service"), kSetBool});
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
  if (!middleware().tells_servers()) GTEST_SKIP() << kNoIds;
  TestSide side("connect_server"), other("connect_client");
  other.gateway.apply(CreateMirror{MirrorId{1}, std::string{kClaimsTopic}, "rcl_interfaces/msg/Log",
                                   "", qos_of_depth(1)});
  other.gateway.apply(
      CreateMirror{MirrorId{2}, topic("a"), kString, "", qos_of_depth(1), "/talker"});
  other.gateway.apply(
      CreateServiceMirror{ServiceMirrorId{1}, topic("service"), kSetBool, "", "/talker"});
  ASSERT_TRUE(side.topic_state(topic("a"), [](const TopicState& state) {
    return state.publishers.size() == 1 && state.publishers[0].node_name == "connect_client";
  }));
  EXPECT_TRUE(side.until([&] {
    const auto states = find(side, topic("service"));
    return states.size() == 1 && states[0].servers[0].node_name == "connect_client";
  }));
}

// The remains of a killed process with our name, including proxies, are ignored.
TEST_F(ServiceGraphTest, WhatANamesakeHasIsNotThere) {
  if (!middleware().tells_servers()) GTEST_SKIP() << kNoIds;
  TestNode robot("robot");
  TestSide side("connect_server"), left("connect_server");
  left.gateway.apply(CreateMirror{MirrorId{1}, topic("own"), kString, "", qos_of_depth(1)});
  left.gateway.apply(
      CreateMirror{MirrorId{2}, topic("a"), kString, "", qos_of_depth(1), "/talker"});
  left.gateway.apply(
      CreateServiceMirror{ServiceMirrorId{1}, topic("service"), kSetBool, "", "/talker"});
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
  side.gateway.apply(CreateServiceMirror{ServiceMirrorId{1}, topic("asked"), kSetBool, ""});
  side.gateway.apply(
      CreateServiceMirror{ServiceMirrorId{2}, topic("proxied"), kSetBool, "", "/other/robot"});
  ASSERT_TRUE(side.until([&] { return client.ready(); }));
  RawServer server(robot, topic("marker"));
  ASSERT_TRUE(side.until([&] { return !find(side, topic("marker")).empty(); }));
  EXPECT_TRUE(find(side, topic("asked")).empty());
  EXPECT_TRUE(find(side, topic("proxied")).empty());
}

// A node that comes up when we have a proxy of its name keeps its services; otherwise a peer could
// make them disappear by choosing a name.
TEST_F(ServiceGraphTest, AProxyHidesNobodysServices) {
  if (!middleware().tells_servers()) GTEST_SKIP() << kNoIds;
  TestSide side("connect_server");
  side.gateway.apply(
      CreateServiceMirror{ServiceMirrorId{1}, topic("remote"), kSetBool, "", "/planner"});
  ASSERT_EQ(1u, side.gateway.counters().proxy_nodes);
  TestNode planner("planner");
  RawServer one(planner, topic("one")), two(planner, topic("two"));
  RawServer same(planner, topic("remote"));  // and one of a service that the proxy has, too
  const std::string action = topic("fib") + "/_action/send_goal";
  RawServer hidden(planner, action, std::string{kTestPackage} + "/action/Fibonacci_SendGoal");
  const auto whole = [&](const GraphChanged& graph) {
    std::size_t found = 0;
    for (const ServiceState& state : graph.services) {
      const bool known = state.name == topic("one") || state.name == topic("two") ||
                         state.name == topic("remote") || state.name == action;
      if (known && state.servers.size() == 1 && state.servers[0].node_name == "planner") ++found;
    }
    return found == 4;
  };
  ASSERT_TRUE(side.until([&] { return whole(side.graph); }));
  side.inputs.clear();
  const int graphs = side.graphs;
  side.gateway.apply(DestroyServiceMirror{ServiceMirrorId{1}});
  side.gateway.apply(RefreshGraph{});
  ASSERT_TRUE(side.until([&] { return side.graphs > graphs; }));
  for (const Input& input : side.inputs) {
    if (const auto* graph = std::get_if<GraphChanged>(&input)) {
      EXPECT_TRUE(whole(*graph));
    }
  }
  const auto states = find(side, action);
  ASSERT_EQ(1u, states.size());
  EXPECT_EQ(std::string{kTestPackage} + "/action/Fibonacci_SendGoal", states[0].type);
}

// The graph is read while proxies are made and removed. One that appears between the list of nodes
// and the question for one of them may be asked in its stead, and that reading misses the real one;
// not the next. (No proxy is made under the name of a node that is there already.)
TEST_F(ServiceGraphTest, AProxyThatComesAndGoesHidesNothing) {
  if (!middleware().tells_servers()) GTEST_SKIP() << kNoIds;
  TestSide side("connect_server");
  TestNode planner("planner");
  const std::string real = topic("service"), mirrored = topic("proxy");
  RawServer server(planner, real);
  ASSERT_TRUE(side.until([&] { return find(side, real).size() == 1; }));
  std::atomic<int> readings{0}, missed_twice{0}, strange{0};
  std::atomic<bool> stop{false};
  std::thread reader([&] {
    for (bool missed = false; !stop;) {
      const auto services = read_services(*side.node, {}, {});
      std::size_t found = 0;
      for (const ServiceState& state : services.value_or(std::vector<ServiceState>{})) {
        if (state.name == real) found += state.servers.size();
        if (state.name == mirrored) ++strange;
      }
      if (missed && found != 1) ++missed_twice;
      missed = found != 1;
      ++readings;
    }
  });
  Shared shared(
      *side.node, 1000, true, [] {}, [](const std::string&) { return false; }, [](Duration) {});
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  int made = 0;
  while ((made < 300 || readings < 300) && std::chrono::steady_clock::now() < deadline) {
    ServiceMirror mirror(shared, {ServiceMirrorId{1}, mirrored, kSetBool, "", "/planner"});
    EXPECT_FALSE(mirror.open());
    EXPECT_EQ(1u, shared.proxies.size());
    ++made;
  }
  stop = true;
  reader.join();
  EXPECT_GE(made, 300);
  EXPECT_GE(readings, 300);
  EXPECT_EQ(0, missed_twice);
  EXPECT_EQ(0, strange);
}

// The remains of a killed process, and its successor.
TEST_F(ServiceGraphTest, TwoNodesOfOneName) {
  if (!middleware().tells_servers()) GTEST_SKIP() << kNoIds;
  TestSide side("connect_server");
  side.gateway.apply(CreateServiceClient{ServiceClientId{1}, topic("both"), kSetBool});
  auto first = std::make_unique<TestNode>("robot"), second = std::make_unique<TestNode>("robot");
  auto a = std::make_unique<RawServer>(*first, topic("both"));
  const auto ids = [&](const std::string& name) {
    std::set<Gid> found;
    for (const ServiceState& state : find(side, name)) {
      for (const Server& server : state.servers) {
        EXPECT_EQ("robot", server.node_name);
        if (server.gid != Gid{}) found.insert(server.gid);
      }
    }
    return found;
  };
  ASSERT_TRUE(side.until([&] { return ids(topic("both")).size() == 1; }));
  const auto before = ids(topic("both"));
  auto b = std::make_unique<RawServer>(*second, topic("both"));
  ASSERT_TRUE(side.until([&] { return ids(topic("both")).size() == 2; }));
  EXPECT_TRUE(ids(topic("both")).contains(*before.begin()));
  RawServer of_first(*first, topic("first")), of_second(*second, topic("second"));
  EXPECT_TRUE(side.until(
      [&] { return find(side, topic("first")).size() + find(side, topic("second")).size() == 2; }));
  a.reset();
  ASSERT_TRUE(side.until([&] { return ids(topic("both")).size() == 1; }));
  EXPECT_FALSE(ids(topic("both")).contains(*before.begin()));
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
  GraphReading reading(*side.node);
  const auto again = std::chrono::steady_clock::now();
  ASSERT_TRUE(reading.read({}));
  const std::chrono::duration<double, std::milli> whole = std::chrono::steady_clock::now() - again;
  std::printf("[          ] 300 topics, 200 services: %.2f ms, %.2f of them for the services\n",
              whole.count(), took.count());
  EXPECT_LT(took, whole / 2);
  if (!middleware().tells_servers()) return;
  // A second node of the name: all services are asked for one by one.
  TestNode namesake("robot");
  RawServer marker(namesake, topic("marker"));
  ASSERT_TRUE(side.until([&] { return !find(side, topic("marker")).empty(); }));
  const auto then = std::chrono::steady_clock::now();
  const auto shared = read_services(*side.node, {}, {});
  const std::chrono::duration<double, std::milli> longer = std::chrono::steady_clock::now() - then;
  ASSERT_TRUE(shared);
  EXPECT_EQ(services->size() + 1, shared->size());
  std::printf("[          ] two nodes of one name: %.2f ms\n", longer.count());
}

}  // namespace
}  // namespace connect_bridge::ros
