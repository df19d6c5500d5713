#include "core/graph/graph_view.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

// The first 12 bytes are the participant's, as in DDS.
Gid gid_of(std::uint8_t participant, std::uint8_t entity = 1) {
  Gid result;
  result.bytes[0] = participant;
  result.bytes[12] = entity;
  return result;
}
Endpoint endpoint(const Gid& id, std::string node, std::string ns = "/") {
  return {id, std::move(ns), std::move(node), {}};
}
TopicState topic(std::string name, std::vector<Endpoint> publishers,
                 std::vector<Endpoint> subscribers = {}) {
  return {std::move(name), "p/msg/T", "", std::move(publishers), std::move(subscribers)};
}
const TopicKey kA{"/a", "p/msg/T"};

TEST(GraphView, HoldsTopicsWithTheirEndpoints) {
  const GraphView graph({{topic("/a", {endpoint(gid_of(1), "n")}), topic("/b", {}, {}),
                          topic("/c", {}, {endpoint(gid_of(2), "m")})}});
  EXPECT_EQ(graph.topics().size(), 2U);  // /b has nobody
  ASSERT_TRUE(graph.find(kA));
  EXPECT_EQ(graph.find(kA)->publishers.size(), 1U);
  EXPECT_FALSE(graph.find({"/a", "p/msg/U"}));
  EXPECT_TRUE(graph.is_local(gid_of(1)));
  EXPECT_FALSE(graph.is_local(gid_of(2)));  // a subscriber is no origin
  EXPECT_TRUE(graph.bridges().empty());
}

TEST(GraphView, ATopicWithTwoTypesIsTwo) {
  auto other = topic("/a", {endpoint(gid_of(2), "m")});
  other.type = "p/msg/U";
  const GraphView graph({{topic("/a", {endpoint(gid_of(1), "n")}), other}});
  EXPECT_EQ(graph.topics().size(), 2U);
}

TEST(GraphView, EndpointsOfABridgesNodeAreLeftOut) {
  const GraphView graph(
      {{topic("/a", {endpoint(gid_of(1), "n"), endpoint(gid_of(2), "connect", "/x")},
              {endpoint(gid_of(3), "connect", "/x"), endpoint(gid_of(4), "n")}),
        topic("/only_the_bridge", {endpoint(gid_of(5), "connect", "/x")}),
        topic(kClaimsTopic, {endpoint(gid_of(9), "connect", "/x")},
              {endpoint(gid_of(8), "connect", "/x")})}});
  ASSERT_EQ(graph.topics().size(), 1U);
  EXPECT_EQ(graph.find(kA)->publishers.at(0).gid, gid_of(1));
  EXPECT_EQ(graph.find(kA)->publishers.size(), 1U);
  EXPECT_EQ(graph.find(kA)->subscribers.at(0).gid, gid_of(4));
  EXPECT_EQ(graph.find(kA)->subscribers.size(), 1U);
  EXPECT_EQ(graph.bridges(), (std::unordered_set<Gid>{gid_of(9)}));
  EXPECT_EQ(graph.bridge_publishers(), (std::unordered_set<Gid>{gid_of(2), gid_of(5)}));
  EXPECT_FALSE(graph.is_local(gid_of(2)));
}

// Also what only its claims show.
TEST(GraphView, WhatABridgePublishesIsBrought) {
  GraphView graph({{topic("/a", {endpoint(gid_of(2), "connect")}, {endpoint(gid_of(4), "n")}),
                    topic("/b", {endpoint(gid_of(1), "n")}),
                    topic("/c", {endpoint(gid_of(5), "proxy")}, {endpoint(gid_of(4), "n")}),
                    topic(kClaimsTopic, {endpoint(gid_of(9), "connect")})}});
  EXPECT_TRUE(graph.is_brought(kA));
  EXPECT_FALSE(graph.is_brought({"/b", "p/msg/T"}));
  EXPECT_FALSE(graph.is_brought({"/c", "p/msg/T"}));
  EXPECT_TRUE(graph.hide({gid_of(5)}));
  EXPECT_TRUE(graph.is_brought({"/c", "p/msg/T"}));
  EXPECT_FALSE(graph.is_brought({"/b", "p/msg/T"}));
}

TEST(GraphView, ANodeOfTheSameNameElsewhereIsNoBridge) {
  const GraphView graph({{topic("/a", {endpoint(gid_of(1), "connect", "/y")}),
                          topic(kClaimsTopic, {endpoint(gid_of(9), "connect", "/x")})}});
  EXPECT_TRUE(graph.is_local(gid_of(1)));
}

TEST(GraphView, ABridgeIsKnownByItsParticipantBeforeItsName) {
  const GraphView graph({{topic("/a", {endpoint(gid_of(9, 2), ""), endpoint(gid_of(1), "")}),
                          topic(kClaimsTopic, {endpoint(gid_of(9, 1), "_NODE_NAME_UNKNOWN_")})}});
  EXPECT_TRUE(graph.is_local(gid_of(1)));
  EXPECT_FALSE(graph.is_local(gid_of(9, 2)));
}

// Of two nodes without a name one may be a bridge; that makes the other none.
TEST(GraphView, UnknownNodeNamesAreNoBridgesName) {
  const GraphView graph(
      {{topic("/a", {endpoint(gid_of(1), "_NODE_NAME_UNKNOWN_", "_NODE_NAMESPACE_UNKNOWN_")}),
        topic(kClaimsTopic,
              {endpoint(gid_of(9), "_NODE_NAME_UNKNOWN_", "_NODE_NAMESPACE_UNKNOWN_")})}});
  EXPECT_TRUE(graph.is_local(gid_of(1)));
}

TEST(GraphView, WhoOnlyListensToTheClaimsIsNoBridge) {
  const GraphView graph({{topic("/a", {endpoint(gid_of(1), "ros2cli")}),
                          topic(kClaimsTopic, {}, {endpoint(gid_of(2), "ros2cli")})}});
  EXPECT_TRUE(graph.is_local(gid_of(1)));
  EXPECT_TRUE(graph.bridges().empty());
  EXPECT_EQ(graph.topics().size(), 1U);
}

TEST(GraphView, NodesAreNamedInFull) {
  EXPECT_EQ(node_of(endpoint(gid_of(1), "n", "/")), "/n");
  EXPECT_EQ(node_of(endpoint(gid_of(1), "n", "")), "/n");
  EXPECT_EQ(node_of(endpoint(gid_of(1), "n", "/x/y")), "/x/y/n");
  EXPECT_EQ(node_of(endpoint(gid_of(1), "", "/x")), "");
  EXPECT_EQ(node_of(endpoint(gid_of(1), "_NODE_NAME_UNKNOWN_", "/x")), "");
}

// DDS 1.4 section 2.2.3, table of QoS policies: what is offered must be at least what is requested.
TEST(GraphView, IncompatiblePolicies) {
  using Change = void (*)(Qos&);
  const auto none = +[](Qos&) {};
  const auto best_effort = +[](Qos& q) { q.reliability = Reliability::kBestEffort; };
  const auto latched = +[](Qos& q) { q.durability = Durability::kTransientLocal; };
  const auto manual = +[](Qos& q) { q.liveliness = Liveliness::kManualByTopic; };
  const auto deadline = +[](Qos& q) { q.deadline = std::chrono::seconds(1); };
  const auto long_deadline = +[](Qos& q) { q.deadline = std::chrono::seconds(2); };
  const auto lease = +[](Qos& q) { q.liveliness_lease = std::chrono::seconds(1); };
  const auto long_lease = +[](Qos& q) { q.liveliness_lease = std::chrono::seconds(2); };
  const auto other = +[](Qos& q) {
    q.depth = 7;
    q.history = History::kKeepAll;
    q.lifespan = std::chrono::seconds(1);
  };
  const struct {
    Change offered, requested;
    const char* policy;
  } rows[] = {
      {none, none, ""},
      {best_effort, none, "reliability"},
      {none, best_effort, ""},
      {best_effort, best_effort, ""},
      {none, latched, "durability"},
      {latched, none, ""},
      {latched, latched, ""},
      {none, deadline, "deadline"},
      {long_deadline, deadline, "deadline"},
      {deadline, long_deadline, ""},
      {deadline, deadline, ""},
      {deadline, none, ""},
      {none, manual, "liveliness"},
      {manual, none, ""},
      {manual, manual, ""},
      {none, lease, "liveliness lease"},
      {long_lease, lease, "liveliness lease"},
      {lease, long_lease, ""},
      {lease, lease, ""},
      {lease, none, ""},
      {other, none, ""},
      {none, other, ""},
  };
  int row_number = 0;
  for (const auto& row : rows) {
    SCOPED_TRACE(row_number++);
    Qos offered;
    Qos requested;
    row.offered(offered);
    row.requested(requested);
    EXPECT_EQ(incompatible_policy(offered, requested), row.policy);
  }
}

TEST(GraphView, ServersOfBridgesAreNoServers) {
  const auto server = [](std::uint8_t participant, const std::string& node) {
    Server result;
    result.gid.bytes[0] = participant;
    result.node_namespace = "/";
    result.node_name = node;
    return result;
  };
  GraphChanged graph;
  TopicState claims;
  claims.name = kClaimsTopic;
  claims.publishers.push_back({Gid{{7}}, "/", "bridge", {}});
  graph.topics = {claims};
  graph.services = {{"/by_name", "p/srv/S", {server(0, "bridge")}},
                    {"/by_participant", "p/srv/S", {server(7, "proxy")}},
                    {"/real", "p/srv/S", {server(0, "talker"), server(7, "proxy")}},
                    {"/real_too", "p/srv/T", {server(8, "talker")}}};
  const GraphView view(std::move(graph));
  ASSERT_EQ(view.services().size(), 2U);
  EXPECT_EQ(view.services().at({"/real", "p/srv/S"}).servers.size(), 1U);
  EXPECT_TRUE(view.has_server("/real_too"));
  EXPECT_FALSE(view.has_server("/by_name"));
  EXPECT_FALSE(view.has_server("/rea"));
}

// A node that starts has endpoints of its own; whoever cares for others' names is not concerned.
TEST(GraphView, DiffersFromAnotherByItsNewNamesAndPublishersAlone) {
  const auto server = [](std::string name) {
    return ServiceState{std::move(name), "p/srv/S", {{gid_of(1), "/", "n"}}};
  };
  const Endpoint early = endpoint(gid_of(1), "n"), late = endpoint(gid_of(2), "m");
  const GraphView before(
      {{topic("/a", {early}, {early}), topic("/b", {}, {early}), topic("/c", {}, {late})},
       {server("/stays"), server("/goes")}});
  const GraphView after(
      {{topic("/a", {early, late}, {early}), topic("/c", {}, {early}), topic("/d", {}, {late})},
       {server("/stays"), server("/comes")}});
  const auto difference = after.since(before);
  EXPECT_FALSE(difference.all);
  EXPECT_EQ(difference.listened,
            (std::set<TopicKey>{{"/b", "p/msg/T"}, {"/c", "p/msg/T"}, {"/d", "p/msg/T"}}));
  EXPECT_EQ(difference.publishers, std::set<Gid>{gid_of(2)});
  EXPECT_EQ(difference.served, (std::set<std::string>{"/comes", "/goes"}));
  const auto none = after.since(after);
  EXPECT_TRUE(!none.all && none.listened.empty() && none.publishers.empty() && none.served.empty());
}

TEST(GraphView, WithAnotherBridgeAnythingMayDiffer) {
  const GraphView before({{topic("/a", {endpoint(gid_of(1), "n")})}});
  const GraphView after({{topic("/a", {endpoint(gid_of(1), "n")}),
                          topic(kClaimsTopic, {endpoint(gid_of(9), "connect", "/x")})}});
  EXPECT_TRUE(after.since(before).all);
  EXPECT_TRUE(before.since(after).all);
}

}  // namespace
}  // namespace connect_bridge
