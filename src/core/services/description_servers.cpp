#include "core/services/description_servers.hpp"

#include <algorithm>

#include "core/types/description_service.hpp"

namespace connect_bridge {

std::string DescriptionServers::service_of(const std::string& node) const {
  return (node.empty() ? own_node_ : node) + "/" + std::string{kDescriptionService};
}

void DescriptionServers::update(const std::function<bool(const std::string&)>& exists, bool alone) {
  const auto& nodes = types_.nodes();
  // What ends makes room for others, within kServersMax.
  for (auto it = servers_.begin(); it != servers_.end();) {
    const auto at = it++;
    if (nodes.empty() || (!at->first.empty() && !(alone && nodes.contains(at->first)))) {
      end(at->second);
      servers_.erase(at);
    }
  }
  if (nodes.empty()) return;
  servers_.try_emplace("");
  for (const auto& [node, users] : nodes)
    if (alone && servers_.size() < kServersMax) servers_.try_emplace(node);
  for (auto& [node, server] : servers_) {
    const std::string service = service_of(node);
    // Two servers of one name would both answer, and the caller would take whatever comes first.
    if (exists(service)) {
      end(server);
    } else if (!server.id && !server.failed) {
      server.id = outputs_.new_service_mirror();
      outputs_.push(CreateServiceMirror{
          server.id, service, std::string{kDescriptionServiceType}, {}, node, false});
    }
  }
}

void DescriptionServers::end(Server& server) {
  if (!server.id) return;
  outputs_.push(DestroyServiceMirror{server.id});
  // Descriptions that still come must not be given as answers of a mirror that does not exist.
  types_.calls().on_server_gone(server.id);
  server.id = {};
}

bool DescriptionServers::on_request(const RequestTaken& request, const Now& now) {
  const bool ours = std::any_of(servers_.begin(), servers_.end(), [&](const auto& entry) {
    return entry.second.id == request.mirror;
  });
  if (ours) types_.calls().begin(request, now);
  return ours;
}

bool DescriptionServers::on_failed(const ServiceMirrorFailed& failed) {
  const auto at = std::find_if(servers_.begin(), servers_.end(),
                               [&](const auto& entry) { return entry.second.id == failed.id; });
  if (at == servers_.end()) return false;
  types_.calls().on_server_gone(failed.id);
  // Not tried again while the node is here: it would fail after each change of the graph.
  at->second = {{}, true};
  outputs_.log(LogLevel::kDebug, service_of(at->first) + " cannot be served: " + failed.reason);
  return true;
}

}  // namespace connect_bridge
