#include <rcl/graph.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "ros/distro.hpp"
#include "ros/graph.hpp"
#include "ros/own_endpoints.hpp"
#include "ros/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

struct NodeName {
  std::string name_space, name;
  auto operator<=>(const NodeName&) const = default;

  [[nodiscard]] std::string full() const {
    return name_space == "/" ? "/" + name : name_space + "/" + name;
  }
};

// The nodes of others. Two of one name and namespace are asked for once: the middleware then
// answers for one of them anyway.
std::optional<std::set<NodeName>> read_nodes(const Node& node) {
  auto allocator = rcl_get_default_allocator();
  auto names = rcutils_get_zero_initialized_string_array();
  auto name_spaces = rcutils_get_zero_initialized_string_array();
  if (!ignore_error(rcl_get_node_names(node.handle(), allocator, &names, &name_spaces))) {
    return std::nullopt;
  }
  std::optional<std::set<NodeName>> nodes{std::in_place};
  for (std::size_t i = 0; i < names.size; ++i) {
    NodeName found{name_spaces.data[i], names.data[i]};
    if (!node.own().contains_node(found.full())) nodes->insert(std::move(found));
  }
  ignore_error(rcutils_string_array_fini(&names));
  ignore_error(rcutils_string_array_fini(&name_spaces));
  return nodes;
}

using ServicesByName = std::map<std::pair<std::string, std::string>, std::vector<Server>>;

void read_services_of(const Node& node, const NodeName& of, ServicesByName& services) {
  auto allocator = rcl_get_default_allocator();
  rcl_names_and_types_t found = rcl_get_zero_initialized_names_and_types();
  // A node that has just left is no failure.
  if (!ignore_error(rcl_get_service_names_and_types_by_node(
          node.handle(), &allocator, of.name.c_str(), of.name_space.c_str(), &found))) {
    return;
  }
  for (std::size_t i = 0; i < found.names.size; ++i) {
    for (std::size_t t = 0; t < found.types[i].size; ++t) {
      services[{found.names.data[i], found.types[i].data[t]}].push_back(
          Server{Gid{}, of.name_space, of.name});
    }
  }
  ignore_error(rcl_names_and_types_fini(&found));
}

// The writers of responses, one for each server, with their ids; empty where the middleware has no
// such topic.
std::vector<Server> read_writers(const Node& node, const std::string& service) {
  std::vector<Server> writers;
  const std::string topic = "rr" + service + "Reply";
  auto allocator = rcl_get_default_allocator();
  auto array = rcl_get_zero_initialized_topic_endpoint_info_array();
  if (!ignore_error(rcl_get_publishers_info_by_topic(node.handle(), &allocator, topic.c_str(), true,
                                                     &array))) {
    return writers;
  }
  for (std::size_t i = 0; i < array.size; ++i) {
    const rmw_topic_endpoint_info_t& info = array.info_array[i];
    writers.push_back(
        Server{distro::gid_of(info.endpoint_gid), info.node_namespace, info.node_name});
  }
  ignore_error(rcl_topic_endpoint_info_array_fini(&array, &allocator));
  return writers;
}

// Tells servers' ids, and whose they really are.
void identify(const Node& node, ServiceState& service, const BridgeParticipants& bridges) {
  std::vector<Server> writers = read_writers(node, service.name);
  std::erase_if(service.servers, [&](Server& server) {
    const auto found = std::find_if(writers.begin(), writers.end(), [&](const Server& writer) {
      return writer.node_name == server.node_name && writer.node_namespace == server.node_namespace;
    });
    if (found == writers.end()) return false;
    server.gid = found->gid;
    writers.erase(found);
    const Gid participant = distro::participant_of(server.gid);
    if (const auto bridge = bridges.others.find(participant); bridge != bridges.others.end()) {
      server.node_namespace = bridge->second.name_space;
      server.node_name = bridge->second.name;
    }
    return bridges.namesakes.contains(participant);
  });
}

}  // namespace

std::optional<std::vector<ServiceState>> read_services(const Node& node,
                                                       const std::set<std::string>& watched,
                                                       const BridgeParticipants& bridges) {
  const auto nodes = read_nodes(node);
  if (!nodes) return std::nullopt;
  ServicesByName services;
  for (const NodeName& other : *nodes) read_services_of(node, other, services);
  std::vector<ServiceState> states;
  states.reserve(services.size());
  for (auto& [key, servers] : services) {
    ServiceState state{key.first, key.second, std::move(servers)};
    // Asking for each one takes long in a large graph, so only where it tells something.
    if (!bridges.empty() || watched.contains(state.name)) identify(node, state, bridges);
    if (!state.servers.empty()) states.push_back(std::move(state));
  }
  return states;
}

}  // namespace connect_bridge::ros
