#include <rcl/graph.h>

#include <algorithm>
#include <string_view>

#include "core/side/graph_view.hpp"
#include "ros/distro.hpp"
#include "ros/graph.hpp"
#include "ros/own_endpoints.hpp"
#include "ros/qos.hpp"
#include "ros/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

using Query = decltype(&rcl_get_publishers_info_by_topic);

// Reads the endpoints of one topic into its states, one per type.
class TopicReading {
 public:
  TopicReading(const Node& node, const char* topic) : node_(node), topic_(topic) {}

  bool read(Query query, std::vector<Endpoint> TopicState::*endpoints) {
    auto allocator = rcl_get_default_allocator();
    auto array = rcl_get_zero_initialized_topic_endpoint_info_array();
    if (!ignore_error(query(node_.handle(), &allocator, topic_, false, &array))) return false;
    for (std::size_t i = 0; i < array.size; ++i) add(array.info_array[i], endpoints);
    ignore_error(rcl_topic_endpoint_info_array_fini(&array, &allocator));
    return true;
  }

  std::vector<TopicState> states;
  bool unknown_names = false;

 private:
  void add(const rmw_topic_endpoint_info_t& info, std::vector<Endpoint> TopicState::*endpoints) {
    Endpoint endpoint;
    endpoint.gid = distro::gid_of(info.endpoint_gid);
    if (node_.own().contains(endpoint.gid)) return;
    endpoint.node_name = info.node_name;
    endpoint.node_namespace = info.node_namespace;
    // What has our name is another bridge beside this one, or what is left of a killed one: nothing
    // of theirs is a user's. Only the claims are wanted, and those a killed one cannot send.
    if (is_namesake(endpoint) && std::string_view(topic_) != kClaimsTopic) return;
    if (endpoint.node_name == "_NODE_NAME_UNKNOWN_") unknown_names = true;
    endpoint.qos = from_rmw(info.qos_profile);
    TopicState& state = state_of(info);
    (state.*endpoints).push_back(std::move(endpoint));
  }

  [[nodiscard]] bool is_namesake(const Endpoint& endpoint) const {
    return endpoint.node_name == node_.name() && endpoint.node_namespace == node_.name_space();
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
};

}  // namespace

std::optional<std::vector<TopicState>> read_graph(const Node& node, bool& unknown_names) {
  auto allocator = rcl_get_default_allocator();
  rcl_names_and_types_t names = rcl_get_zero_initialized_names_and_types();
  if (!ignore_error(rcl_get_topic_names_and_types(node.handle(), &allocator, false, &names))) {
    return std::nullopt;
  }
  std::optional<std::vector<TopicState>> topics{std::in_place};
  topics->reserve(names.names.size);
  for (std::size_t i = 0; topics && i < names.names.size; ++i) {
    TopicReading reading(node, names.names.data[i]);
    if (!reading.read(&rcl_get_publishers_info_by_topic, &TopicState::publishers) ||
        !reading.read(&rcl_get_subscriptions_info_by_topic, &TopicState::subscribers)) {
      topics.reset();
      break;
    }
    unknown_names = unknown_names || reading.unknown_names;
    std::move(reading.states.begin(), reading.states.end(), std::back_inserter(*topics));
  }
  ignore_error(rcl_names_and_types_fini(&names));
  return topics;
}

}  // namespace connect_bridge::ros
