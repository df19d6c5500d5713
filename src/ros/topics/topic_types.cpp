#include "ros/topics/topic_types.hpp"

#include <fmt/format.h>
#include <rcl/graph.h>

#include <map>
#include <set>

#include "core/graph/graph_view.hpp"
#include "ros/rcl/graph_queries.hpp"

namespace connect_bridge::ros {
namespace {

using NodesByType = std::map<std::string, std::set<std::string>>;

void read(EndpointQuery query, const Node& node, const std::string& topic, NodesByType& types) {
  for (const auto& info : TopicEndpoints(query, node.handle(), topic.c_str())) {
    const std::string name = node_of(Endpoint{{}, info.node_namespace, info.node_name, {}});
    types[info.topic_type].insert(name.empty() ? "a node without a name" : name);
  }
}

// Makes "std_msgs/msg/String (/talker, /listener)".
std::string shown(const std::string& type, const std::set<std::string>& nodes) {
  return nodes.empty() ? type : fmt::format("{} ({})", type, fmt::join(nodes, ", "));
}

}  // namespace

Refusal endpoint_failure(const Node& node, const std::string& topic, const std::string& type,
                         const std::string& what, rcl_ret_t result) {
  Refusal words = failure(what + " " + topic, result);
  NodesByType types;
  read(&rcl_get_publishers_info_by_topic, node, topic, types);
  read(&rcl_get_subscriptions_info_by_topic, node, topic, types);
  const std::set<std::string> ours = types[type];
  types.erase(type);
  if (types.empty()) return words;
  const auto& [other, nodes] = *types.begin();
  return {"type_mismatch", "the topic " + topic + " has the type " + shown(other, nodes) +
                               " here and cannot have the type " + shown(type, ours) + " as well"};
}

}  // namespace connect_bridge::ros
