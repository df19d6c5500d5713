#include "ros/graph/service_reading.hpp"

#include <rcl/graph.h>

#include <algorithm>
#include <string>
#include <utility>

#include "ros/node/own_endpoints.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/rcl/graph_queries.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

struct Nodes {
  std::set<NodeName> plain;
  // Names of several nodes, or of a node and a proxy of ours. The middleware answers for an
  // arbitrary one of them, so their services are found by their writers, if the middleware shows
  // these.
  std::set<NodeName> shared;
};

// Reads the nodes of others.
std::optional<Nodes> read_nodes(const Node& node) {
  const auto ours_before = node.own().nodes();
  const auto names = names_of_nodes(node);
  if (!names) return std::nullopt;
  const auto ours_after = node.own().nodes();
  std::map<NodeName, std::size_t> counts;
  for (const NodeName& name : *names) ++counts[name];

  std::optional<Nodes> nodes{std::in_place};
  for (const auto& [found, count] : counts) {
    const std::string full = full_name(found);
    if (full == node.facts().full_name) continue;
    const auto before = ours_before.find(full), after = ours_after.find(full);
    const bool foreign = before == ours_before.end() && after == ours_after.end();
    // Our node was in the graph all the time, so it is one of the counted nodes.
    const bool steady = before != ours_before.end() && after != ours_after.end() &&
                        before->second != OwnEndpoints::kUnsettled &&
                        before->second == after->second;
    if (foreign && (count == 1 || !middleware().tells_servers())) nodes->plain.insert(found);
    if (count > 1 || !(foreign || steady)) nodes->shared.insert(found);
  }
  return nodes;
}

// A server, known by its writer of responses.
struct Writer {
  Gid gid;
  NodeName node;
  std::string type;  // "std_srvs/srv/SetBool"; empty: unknown

  [[nodiscard]] bool may_have(const std::string& other) const {
    return type.empty() || type == other;
  }
};

// Makes "std_srvs/srv/SetBool" from "std_srvs::srv::dds_::SetBool_Response_".
std::string service_type_of(std::string_view response) {
  constexpr std::string_view kMiddle = "::dds_::", kEnd = "_Response_";
  const auto middle = response.find(kMiddle);
  if (middle == std::string_view::npos || !response.ends_with(kEnd)) return {};
  std::string type{response.substr(0, middle)};
  if (const auto colons = type.find("::"); colons != std::string::npos)
    type.replace(colons, 2, "/");
  response.remove_suffix(kEnd.size());
  return type + "/" + std::string{response.substr(middle + kMiddle.size())};
}

class ServiceReading {
 public:
  ServiceReading(const Node& node, const std::set<std::string>& watched,
                 const BridgeParticipants& bridges, const std::function<void()>& between)
      : node_(node), watched_(watched), bridges_(bridges), between_(between) {}

  // False: the middleware failed.
  bool add_all(const Nodes& nodes);
  std::vector<ServiceState> finish();

 private:
  void add_services_of(const NodeName& of);
  bool add_services_of_shared(const std::set<NodeName>& names);
  const std::vector<Writer>& writers_of(const std::string& service);
  void identify(ServiceState& service);

  const Node& node_;
  const std::set<std::string>& watched_;
  const BridgeParticipants& bridges_;
  const std::function<void()>& between_;
  // The nodes that have servers, by the service's name and type.
  std::map<std::pair<std::string, std::string>, std::set<NodeName>> services_;
  std::map<std::string, std::vector<Writer>> writers_;
};

bool ServiceReading::add_all(const Nodes& nodes) {
  for (const NodeName& name : nodes.plain) add_services_of(name);
  return nodes.shared.empty() || !middleware().tells_servers() ||
         add_services_of_shared(nodes.shared);
}

void ServiceReading::add_services_of(const NodeName& of) {
  between_();
  // A node that has just left has no services: that is no error.
  const NamesAndTypes found(&rcl_get_service_names_and_types_by_node, node_.handle(),
                            of.name.c_str(), of.name_space.c_str());
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (const char* type : found.types(i)) services_[{found.name(i), type}].insert(of);
  }
}

bool ServiceReading::add_services_of_shared(const std::set<NodeName>& names) {
  const NamesAndTypes found(&rcl_get_service_names_and_types, node_.handle());
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (const Writer& writer : writers_of(found.name(i))) {
      if (!names.contains(writer.node)) continue;
      for (const char* type : found.types(i)) {
        if (!writer.may_have(type)) continue;
        services_[{found.name(i), type}].insert(writer.node);
      }
    }
  }
  return found.ok();
}

// The servers of others; empty if the middleware has no such topic.
const std::vector<Writer>& ServiceReading::writers_of(const std::string& service) {
  const auto [at, is_new] = writers_.try_emplace(service);
  std::vector<Writer>& writers = at->second;
  if (!is_new) return writers;
  between_();
  const std::string topic = "rr" + service + "Reply";
  for (const auto& info :
       TopicEndpoints(&rcl_get_publishers_info_by_topic, node_.handle(), topic.c_str(), true)) {
    const Gid gid = distro::gid_of(info.endpoint_gid);
    if (node_.own().contains(gid)) continue;
    writers.push_back(
        Writer{gid, {info.node_namespace, info.node_name}, service_type_of(info.topic_type)});
  }
  return writers;
}

// Adds the servers' ids and their real nodes. A name may belong to several nodes: a killed process
// stays in the graph until its lease expires, while its successor runs already.
void ServiceReading::identify(ServiceState& service) {
  std::vector<Server> servers;
  for (Server& server : service.servers) {
    const NodeName name{server.node_namespace, server.node_name};
    bool known = false;
    for (const Writer& writer : writers_of(service.name)) {
      if (writer.node != name || !writer.may_have(service.type)) continue;
      known = true;
      Server found{writer.gid, name.name_space, name.name};
      if (bridges_.attribute(found.gid, found.node_namespace, found.node_name))
        servers.push_back(std::move(found));
    }
    if (!known) servers.push_back(std::move(server));
  }
  service.servers = std::move(servers);
}

std::vector<ServiceState> ServiceReading::finish() {
  std::vector<ServiceState> states;
  states.reserve(services_.size());
  for (const auto& [key, nodes] : services_) {
    ServiceState state{key.first, key.second, {}};
    for (const NodeName& of : nodes) state.servers.push_back(Server{Gid{}, of.name_space, of.name});
    // Questions about each service take long in a large graph, so only useful ones are asked.
    if (!bridges_.empty() || watched_.contains(state.name)) identify(state);
    if (!state.servers.empty()) states.push_back(std::move(state));
  }
  return states;
}

constexpr std::size_t kUnservedMax = 256;  // limit of services without a server

// A service is called if somebody else has a client of it, which writes its requests.
bool is_called(const Node& node, const std::string& service) {
  if (!middleware().tells_servers())
    return distro::count_clients(node.handle(), service.c_str()).value_or(0) > 0;
  const std::string topic = "rq" + service + "Request";
  const TopicEndpoints writers(&rcl_get_publishers_info_by_topic, node.handle(), topic.c_str(),
                               true);
  return std::any_of(writers.begin(), writers.end(), [&](const auto& info) {
    return !node.own().contains(distro::gid_of(info.endpoint_gid));
  });
}

}  // namespace

bool BridgeParticipants::attribute(const Gid& gid, std::string& name_space,
                                   std::string& name) const {
  const Gid participant = middleware().participant_of(gid);
  if (namesakes.contains(participant)) return false;
  if (const auto bridge = others.find(participant); bridge != others.end()) {
    name_space = bridge->second.name_space;
    name = bridge->second.name;
  }
  return true;
}

std::string full_name(const NodeName& node) {
  return node.name_space == "/" ? "/" + node.name : node.name_space + "/" + node.name;
}

std::optional<std::vector<NodeName>> names_of_nodes(const Node& node) {
  auto names = rcutils_get_zero_initialized_string_array();
  auto name_spaces = rcutils_get_zero_initialized_string_array();
  if (!ignore_error(
          rcl_get_node_names(node.handle(), rcl_get_default_allocator(), &names, &name_spaces)))
    return std::nullopt;
  std::optional<std::vector<NodeName>> found{std::in_place};
  for (std::size_t i = 0; i < names.size; ++i)
    found->push_back({name_spaces.data[i], names.data[i]});
  ignore_error(rcutils_string_array_fini(&names));
  ignore_error(rcutils_string_array_fini(&name_spaces));
  return found;
}

std::optional<std::vector<ServiceState>> read_services(const Node& node,
                                                       const std::set<std::string>& watched,
                                                       const BridgeParticipants& bridges,
                                                       const std::function<void()>& between) {
  const auto nodes = read_nodes(node);
  if (!nodes) return std::nullopt;
  ServiceReading reading(node, watched, bridges, between);
  if (!reading.add_all(*nodes)) return std::nullopt;
  return reading.finish();
}

std::vector<CalledService> read_called(const Node& node, const std::vector<ServiceState>& served,
                                       const std::function<void()>& between) {
  std::set<std::string> names;
  for (const ServiceState& service : served) names.insert(service.name);
  const auto mirrors = node.own().servers();
  const std::string own = node.facts().full_name + "/";
  std::vector<CalledService> called;
  std::size_t asked = 0;
  between();
  const NamesAndTypes found(&rcl_get_service_names_and_types, node.handle());
  for (std::size_t i = 0; i < found.size() && asked < kUnservedMax; ++i) {
    const std::string name = found.name(i);
    if (names.contains(name) || name.starts_with(own)) continue;
    // A mirror of this side serves it; a caller may use another type.
    if (mirrors.contains(name) && found.types(i).size() < 2) continue;
    ++asked;
    between();
    if (!is_called(node, name)) continue;
    for (const char* type : found.types(i)) called.push_back({name, type});
  }
  std::sort(called.begin(), called.end());
  return called;
}

}  // namespace connect_bridge::ros
