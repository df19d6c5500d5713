#include "ros/graph/called_services.hpp"

#include <rcl/graph.h>

#include <algorithm>
#include <set>
#include <string>

#include "ros/node/own_endpoints.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/rcl/graph_queries.hpp"
#include "ros/rcl/middleware.hpp"

namespace connect_bridge::ros {
namespace {

constexpr std::size_t kAskedMax = 256;  // services without a server

// A client writes requests.
bool is_called(const Node& node, const std::string& service) {
  if (!middleware().tells_servers())
    return distro::count_clients(node.handle(), service.c_str(), 0).value_or(0) > 0;
  const std::string topic = "rq" + service + "Request";
  const TopicEndpoints writers(&rcl_get_publishers_info_by_topic, node.handle(), topic.c_str(),
                               true);
  return std::any_of(writers.begin(), writers.end(), [&](const auto& info) {
    return !node.own().contains(distro::gid_of(info.endpoint_gid));
  });
}

}  // namespace

std::vector<CalledService> read_called(const Node& node, const std::vector<ServiceState>& served,
                                       const std::function<void()>& between) {
  std::set<std::string> names;
  for (const ServiceState& service : served) names.insert(service.name);
  for (const auto& [name, count] : node.own().servers()) names.insert(name);
  const std::string own = node.facts().full_name + "/";
  std::vector<CalledService> called;
  std::size_t asked = 0;
  between();
  const NamesAndTypes found(&rcl_get_service_names_and_types, node.handle());
  for (std::size_t i = 0; i < found.size() && asked < kAskedMax; ++i) {
    const std::string name = found.name(i);
    if (names.contains(name) || name.starts_with(own)) continue;
    ++asked;
    between();
    if (!is_called(node, name)) continue;
    for (const char* type : found.types(i)) called.push_back({name, type});
  }
  std::sort(called.begin(), called.end());
  return called;
}

}  // namespace connect_bridge::ros
