#include "ros/graph/graph_reading.hpp"

#include <rcl/graph.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <string_view>
#include <utility>

#include "core/graph/graph_view.hpp"
#include "ros/graph/service_reading.hpp"
#include "ros/node/own_endpoints.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/rcl/graph_queries.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/rcl/qos.hpp"

namespace connect_bridge::ros {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Duration kLongQuestion = std::chrono::microseconds(50);

// Reads the endpoints of one topic into its states, one for each type.
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
    // belongs to a user. Only its claims matter, and a killed bridge cannot send claims.
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

// The topics of others' nodes; nullopt: the middleware failed.
std::optional<std::set<std::string>> topics_of_nodes(const Node& node,
                                                     const std::function<void()>& between) {
  const auto nodes = names_of_nodes(node);
  if (!nodes) return std::nullopt;
  const auto ours = node.own().nodes();
  std::set<std::string> topics;
  for (const NodeName& of : *nodes) {
    if (const std::string full = full_name(of);
        full == node.facts().full_name || ours.contains(full))
      continue;
    for (const auto query : {&rcl_get_publisher_names_and_types_by_node,
                             &rcl_get_subscriber_names_and_types_by_node}) {
      between();
      // A node that has just left has no names: that is no error.
      const NamesAndTypes found(query, node.handle(), false, of.name.c_str(),
                                of.name_space.c_str());
      for (std::size_t i = 0; i < found.size(); ++i) topics.insert(found.name(i));
    }
  }
  return topics;
}

}  // namespace

std::optional<GraphChanged> GraphReading::read(const std::set<std::string>& watched, bool changed,
                                               const std::function<Duration(Duration)>& between) {
  unknown_names_ = false;
  rested_ = {};
  changed_ = changed_ || changed;
  auto asked = Clock::now();
  const auto leave_to_others = [&] {
    const Duration took = Clock::now() - asked;
    rested_ += between(took < kLongQuestion ? Duration::zero() : took);
    asked = Clock::now();
  };
  BridgeParticipants bridges;
  if (!read_topics(bridges, leave_to_others)) return std::nullopt;
  auto services = read_services(node_, watched, bridges, leave_to_others);
  if (!services) return std::nullopt;
  auto called = read_called(node_, *services, leave_to_others);
  std::vector<TopicState> topics;
  for (const auto& [name, states] : topics_)
    topics.insert(topics.end(), states.begin(), states.end());
  attribute(topics, bridges);
  bridges_ = std::move(bridges);
  return GraphChanged{std::move(topics), std::move(*services), std::move(called)};
}

bool GraphReading::read_topics(BridgeParticipants& bridges, const std::function<void()>& between) {
  auto topics = topics_of_nodes(node_, between);
  if (!topics) return false;
  topics->insert(kClaimsTopic);
  for (const auto& [name, states] : topics_) topics->insert(name);
  for (const std::string& name : *topics) {
    between();
    if (!read_states(name, bridges)) return false;
  }
  return read_rest(bridges, between);
}

// Reads a portion of the remaining topics. They may have endpoints of nodes whose names are unknown
// or not unique, or of programs without ROS.
bool GraphReading::read_rest(BridgeParticipants& bridges, const std::function<void()>& between) {
  between();
  if (changed_ && !ask_for_rest()) return false;
  const auto end = Clock::now() + time_for_rest_;
  while (next_ < rest_.size()) {
    if (!read_states(rest_[next_], bridges)) return false;
    ++next_;
    if (Clock::now() >= end) break;
    between();
  }
  return true;
}

// Lists the remaining topics: new ones come first, then those whose turn was next.
bool GraphReading::ask_for_rest() {
  const NamesAndTypes found(&rcl_get_topic_names_and_types, node_.handle(), false);
  if (!found.ok()) return false;
  std::set<std::string> names;
  for (std::size_t i = 0; i < found.size(); ++i)
    if (!topics_.contains(found.name(i))) names.emplace(found.name(i));
  std::rotate(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(next_), rest_.end());
  std::erase_if(rest_, [&](const std::string& name) { return names.erase(name) == 0; });
  rest_.insert(rest_.begin(), names.begin(), names.end());
  next_ = 0;
  changed_ = false;
  return true;
}

bool GraphReading::read_states(const std::string& topic, BridgeParticipants& bridges) {
  TopicReading reading(node_, topic.c_str(), bridges);
  if (!reading.read()) return false;
  unknown_names_ = unknown_names_ || reading.unknown_names;
  keep(topic, std::move(reading.states));
  return true;
}

void GraphReading::keep(const std::string& topic, std::vector<TopicState> states) {
  if (states.empty()) {
    topics_.erase(topic);
  } else {
    topics_[topic] = std::move(states);
  }
}

bool GraphReading::read_topic(const std::string& topic, GraphChanged& graph) {
  // The claims are read, too: they identify a bridge that has just started.
  TopicReading claims(node_, kClaimsTopic, bridges_);
  TopicReading reading(node_, topic.c_str(), bridges_);
  if (!claims.read() || !reading.read()) return false;
  keep(topic, reading.states);
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
