#include "ros/topics/topic_types.hpp"

#include <rcl/graph.h>

#include <map>
#include <set>

#include "core/graph/graph_view.hpp"

namespace connect_bridge::ros {
namespace {

using Query = decltype(&rcl_get_publishers_info_by_topic);
using NodesByType = std::map<std::string, std::set<std::string>>;

void read(Query query, const Node& node, const std::string& topic, NodesByType& types) {
  auto allocator = rcl_get_default_allocator();
  auto array = rcl_get_zero_initialized_topic_endpoint_info_array();
  if (!ignore_error(query(node.handle(), &allocator, topic.c_str(), false, &array))) return;
  for (std::size_t i = 0; i < array.size; ++i) {
    const auto& info = array.info_array[i];
    const std::string name = node_of(Endpoint{{}, info.node_namespace, info.node_name, {}});
    types[info.topic_type].insert(name.empty() ? "a node without a name" : name);
  }
  ignore_error(rcl_topic_endpoint_info_array_fini(&array, &allocator));
}

// "std_msgs/msg/String (/talker, /listener)"
std::string shown(const std::string& type, const std::set<std::string>& nodes) {
  std::string names;
  for (const auto& name : nodes) names += (names.empty() ? "" : ", ") + name;
  return names.empty() ? type : type + " (" + names + ")";
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
