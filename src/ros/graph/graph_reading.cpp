#include "ros/graph/graph_reading.hpp"

#include <rcl/graph.h>

#include <algorithm>
#include <string_view>

#include "core/graph/graph_view.hpp"
#include "ros/graph/service_reading.hpp"
#include "ros/node/own_endpoints.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/rcl/graph_queries.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/rcl/qos.hpp"

namespace connect_bridge::ros {
namespace {

// Reads the endpoints of one topic into its states, one per type.
class TopicReading {
 public:
  TopicReading(const Node& node, const char* topic, BridgeParticipants& bridges)
      : node_(node),
        topic_(topic),
        is_claims_(std::string_view(topic) == kClaimsTopic),
        bridges_(bridges) {}

  // False: the middleware failed.
  bool read() {
    return read(&rcl_get_publishers_info_by_topic, &TopicState::publishers) &&
           read(&rcl_get_subscriptions_info_by_topic, &TopicState::subscribers);
  }

  std::vector<TopicState> states;
  bool unknown_names = false;

 private:
  bool read(EndpointQuery query, std::vector<Endpoint> TopicState::*endpoints) {
    const TopicEndpoints found(query, node_.handle(), topic_);
    for (const auto& info : found) add(info, endpoints);
    return found.ok();
  }

  void add(const rmw_topic_endpoint_info_t& info, std::vector<Endpoint> TopicState::*endpoints) {
    Endpoint endpoint;
    endpoint.gid = distro::gid_of(info.endpoint_gid);
    if (node_.own().contains(endpoint.gid)) return;
    endpoint.node_name = info.node_name;
    endpoint.node_namespace = info.node_namespace;
    // A node with our name is another bridge, or the remains of a killed one: none of its endpoints
    // is a user's. Only its claims are of interest, and a killed one cannot send them.
    if (!node_.own().shows(endpoint.gid)) {
      note_bridge(endpoint, endpoints == &TopicState::publishers);
      if (is_namesake(endpoint) && !is_claims_) return;
    }
    if (endpoint.node_name == "_NODE_NAME_UNKNOWN_") unknown_names = true;
    endpoint.qos = from_rmw(info.qos_profile);
    TopicState& state = state_of(info);
    (state.*endpoints).push_back(std::move(endpoint));
  }

  void note_bridge(const Endpoint& endpoint, bool publishes) {
    const Gid participant = middleware().participant_of(endpoint.gid);
    if (participant == Gid{}) return;
    if (is_namesake(endpoint)) {
      bridges_.namesakes.insert(participant);
    } else if (is_claims_ && publishes) {
      bridges_.others[participant] = {endpoint.node_namespace, endpoint.node_name};
    }
  }

  [[nodiscard]] bool is_namesake(const Endpoint& endpoint) const {
    return endpoint.node_name == node_.facts().name &&
           endpoint.node_namespace == node_.facts().name_space;
  }

  // Publishers are read first, so the hash is a publisher's if there is one.
  TopicState& state_of(const rmw_topic_endpoint_info_t& info) {
    for (TopicState& state : states) {
      if (state.type != info.topic_type) continue;
      if (state.type_hash.empty()) state.type_hash = distro::type_hash_of(info);
      return state;
    }
    TopicState& state = states.emplace_back();
    state.name = topic_;
    state.type = info.topic_type;
    state.type_hash = distro::type_hash_of(info);
    return state;
  }

  const Node& node_;
  const char* topic_;
  const bool is_claims_;
  BridgeParticipants& bridges_;
};

void attribute(std::vector<TopicState>& topics, const BridgeParticipants& bridges) {
  if (bridges.empty()) return;
  const auto attribute_all = [&](std::vector<Endpoint>& endpoints) {
    std::erase_if(endpoints, [&](Endpoint& of) {
      return !bridges.attribute(of.gid, of.node_namespace, of.node_name);
    });
  };
  std::erase_if(topics, [&](TopicState& topic) {
    if (topic.name == kClaimsTopic) return false;
    attribute_all(topic.publishers);
    attribute_all(topic.subscribers);
    return topic.publishers.empty() && topic.subscribers.empty();
  });
}

}  // namespace

std::optional<GraphChanged> GraphReading::read(const std::set<std::string>& watched,
                                               const std::function<void()>& between) {
  unknown_names_ = false;
  BridgeParticipants bridges;
  auto topics = read_topics(bridges, between);
  if (!topics) return std::nullopt;
  auto services = read_services(node_, watched, bridges, between);
  if (!services) return std::nullopt;
  auto called = read_called(node_, *services, between);
  bridges_ = std::move(bridges);
  return GraphChanged{std::move(*topics), std::move(*services), std::move(called)};
}

std::optional<std::vector<TopicState>> GraphReading::read_topics(
    BridgeParticipants& bridges, const std::function<void()>& between) {
  const NamesAndTypes found(&rcl_get_topic_names_and_types, node_.handle(), false);
  if (!found.ok()) return std::nullopt;
  std::vector<TopicState> topics;
  topics.reserve(found.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    between();
    TopicReading reading(node_, found.name(i), bridges);
    if (!reading.read()) return std::nullopt;
    unknown_names_ = unknown_names_ || reading.unknown_names;
    std::move(reading.states.begin(), reading.states.end(), std::back_inserter(topics));
  }
  attribute(topics, bridges);
  return topics;
}

bool GraphReading::read_topic(const std::string& topic, GraphChanged& graph) {
  // A bridge that has just come is known by its claims.
  TopicReading claims(node_, kClaimsTopic, bridges_);
  TopicReading reading(node_, topic.c_str(), bridges_);
  if (!claims.read() || !reading.read()) return false;
  attribute(reading.states, bridges_);
  auto& topics = graph.topics;
  const auto is_of_it = [&](const TopicState& state) { return state.name == topic; };
  const auto at = std::find_if(topics.begin(), topics.end(), is_of_it) - topics.begin();
  std::erase_if(topics, is_of_it);
  topics.insert(topics.begin() + at, std::make_move_iterator(reading.states.begin()),
                std::make_move_iterator(reading.states.end()));
  return true;
}

}  // namespace connect_bridge::ros
