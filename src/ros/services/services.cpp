#include "ros/services/services.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

namespace connect_bridge::ros {
namespace {

// The graph shows a server shortly before our client is connected with it. For this time after a
// change we look again, at growing intervals.
constexpr auto kSettling = std::chrono::milliseconds(400);
constexpr Duration kFirstLook = std::chrono::milliseconds(5);

}  // namespace

void Services::create_client(const CreateServiceClient& action) {
  if (!clients.create(action)) return;
  unwatched_ = true;
  changed_ = std::chrono::steady_clock::now();
  graph_.look_again(Duration::zero());
}

void Services::destroy_client(ServiceClientId id) {
  if (!clients.destroy(id)) return;
  unwatched_ = true;
  shared_.ready.wake();
}

// Once for all that came or went together: a link that dies takes hundreds along.
void Services::watch_servers() {
  if (!std::exchange(unwatched_, false)) return;
  std::set<std::string> names;
  for (const auto& [id, client] : clients) names.insert(client->service());
  graph_.watch(std::move(names));
}

void Services::look_at_graph(bool changed) {
  if (changed) changed_ = std::chrono::steady_clock::now();
  look_for_servers(changed);
  look_for_callers(changed);
}

// Each look goes through all endpoints of the graph, and a robot may have hundreds of services. So
// between changes those that have their server are looked at for a tenth of the time at most.
void Services::look_for_servers(bool changed) {
  const auto now = std::chrono::steady_clock::now();
  const bool all = changed || now >= all_due_;
  bool alone = false;
  for (const auto& [id, client] : clients) {
    const bool settled = client->server().is_ready() && !client->server().is_alone();
    if (settled && !all) continue;
    if (auto news = client->look_for_server(now)) shared_.report(std::move(*news));
    const ServerSight& server = client->server();
    alone = alone || server.is_alone();
    if (const auto next = server.next_look()) graph_.look_again(*next);
  }
  const auto end = std::chrono::steady_clock::now();
  if (all) all_due_ = end + 10 * (end - now);
  const auto settling = now - changed_;
  if (alone && settling < kSettling)
    graph_.look_again(std::max<Duration>(kFirstLook, settling / 2));
}

void Services::look_for_callers(bool changed) {
  bool doubtful = false;
  for (const auto& [id, mirror] : mirrors) {
    if (changed) mirror->graph_changed();
    if (changed || mirror->has_new_callers() || mirror->has_doubtful_callers()) {
      auto gone = mirror->look_for_callers();
      if (!gone.empty()) shared_.report(CallersGone{id, std::move(gone)});
    }
    doubtful = doubtful || mirror->has_doubtful_callers();
  }
  if (doubtful) graph_.look_again(ServiceMirror::kDoubt);
}

std::size_t Services::pending() const {
  std::size_t count = 0;
  for (const auto& [id, mirror] : mirrors) count += mirror->requests();
  for (const auto& [id, client] : clients) count += client->invocations();
  return count;
}

}  // namespace connect_bridge::ros
