// Which real servers a service has, and the client that calls them.
#include <algorithm>

#include "core/link/options.hpp"
#include "core/policy/interface.hpp"
#include "core/services/service_exports.hpp"

namespace connect_bridge {

void ServiceExports::update_servers(Service& service, const ServiceState& state, const Now& now) {
  std::map<Gid, TimePoint> servers;
  const auto first_seen = service.servers.empty() ? TimePoint::min() : now.steady;
  for (const auto& server : state.servers) {
    if (server.gid == Gid{}) continue;
    const auto known = service.servers.find(server.gid);
    servers[server.gid] = known == service.servers.end() ? first_seen : known->second;
  }
  service.node = node_of(state.servers.front());
  // Two of one node are mostly a killed process, which stays in the graph for a while, and the one
  // in its place.
  const bool several = std::any_of(state.servers.begin(), state.servers.end(),
                                   [&](const Server& s) { return node_of(s) != service.node; });
  if (several && !std::exchange(service.warned_several, true))
    outputs_.log(LogLevel::kWarn,
                 service.key.first +
                     " has several servers: each call reaches all of them, and the "
                     "first answer counts");
  const auto stays = [&](const auto& server) { return servers.contains(server.first); };
  // Another server in the place of the old one remembers nothing of the calls that were made.
  const bool replaced = !servers.empty() && !service.servers.empty() &&
                        std::none_of(service.servers.begin(), service.servers.end(), stays);
  // The graph tells servers' ids for some services only, and only while there is a client.
  if (!servers.empty() && servers != service.servers) {
    service.failed = false;
    service.servers = std::move(servers);
    if (replaced) return renew(service, now);
    end_lost(service, now);
  }
}

// The server that was called is gone, and another may be there: offered again, as something new.
void ServiceExports::renew(Service& service, const Now& now) {
  end_line(service);
  for (auto& [id, served] : service.links) end(served, now);
  service.links.clear();
  release_client(service);
  offers_due_ = true;
}

// Only servers that are gone could have answered them, and they would keep their places for ever.
void ServiceExports::end_lost(Service& service, const Now& now) {
  TimePoint since = TimePoint::max();
  for (const auto& [gid, seen] : service.servers) since = std::min(since, seen);
  for (auto& [link, served] : service.links) {
    const std::size_t before = served.calls.size();
    for (auto it = served.calls.begin(); it != served.calls.end();) {
      const auto at = it++;
      if (at->second.state != CallState::kInFlight || at->second.invoked >= since) continue;
      ++served.counts.lost;
      refuse(served, at->first, "lost", "the server that was called is gone");
      erase(served, at);
    }
    if (served.calls.size() < before) resume(served, now);
  }
}

void ServiceExports::use_client(Service& service) {
  if (service.client || service.failed) return;
  // Without a client the graph told no ids: those of before may be of servers long gone.
  service.servers.clear();
  if (const auto it = graph_.services().find(service.key); it != graph_.services().end())
    for (const auto& server : it->second.servers)
      if (server.gid != Gid{}) service.servers[server.gid] = TimePoint::min();
  service.client = outputs_.new_service_client();
  by_client_[service.client] = &service;
  outputs_.push(CreateServiceClient{service.client, service.key.first, service.key.second});
  note_action_use(service, true);
}

void ServiceExports::note_action_use(const Service& service, bool on) {
  const auto part = part_of_action(InterfaceKind::kService, service.key.first, service.key.second);
  if (part && part->part == ActionPart::kSendGoal)
    action_uses_.push_back({std::string(part->action), on});
}

void ServiceExports::release_client(Service& service) {
  const bool held = std::any_of(service.links.begin(), service.links.end(),
                                [](const auto& e) { return e.second.held; });
  if (held || !service.client) return;
  end_line(service);
  outputs_.push(DestroyServiceClient{service.client});
  by_client_.erase(service.client);
  service.client = {};
  service.ready = false;
  note_action_use(service, false);
}

}  // namespace connect_bridge
