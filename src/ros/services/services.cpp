#include "ros/services/services.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

namespace connect_bridge::ros {
namespace {

// The graph shows a server shortly before our client is connected to it. For this time after a
// change the clients are looked at again, at growing intervals.
constexpr auto kSettling = std::chrono::milliseconds(400);
constexpr Duration kFirstLook = std::chrono::milliseconds(5);
// Comparing the definitions of all mirrors' clients takes long in a large graph, and nobody waits
// for the result.
constexpr Duration kComparingPause = std::chrono::seconds(2);

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

// One update covers all clients that came or went together: a link that dies takes hundreds along.
void Services::watch_servers() {
  if (!std::exchange(unwatched_, false)) return;
  std::set<std::string> names;
  for (const auto& [id, client] : clients) names.insert(client->service());
  graph_.watch(std::move(names));
}

void Services::look_at_graph(bool changed) {
  const auto now = std::chrono::steady_clock::now();
  if (changed) changed_ = now;
  line_up(changed || (line_.empty() && now >= all_due_));
  line_up_mirrors(changed);
  look_for_callers(changed);
}

// Between changes, looks at clients that have their server take at most a tenth of the time.
void Services::line_up(bool all) {
  for (const bool settled : {false, true}) {
    for (const auto& [id, client] : clients) {
      const ServerSight& server = client->server();
      if ((server.is_ready() && !server.is_alone()) != settled || (settled && !all)) continue;
      if (in_line_.insert(id).second) line_.push_back(id);
    }
  }
}

void Services::line_up_mirrors(bool changed) {
  to_compare_ = to_compare_ || changed;
  if (!to_compare_ || mirrors.size() == 0 || !uncompared_.empty()) return;
  const auto now = std::chrono::steady_clock::now();
  if (now < compare_due_) return graph_.look_again(compare_due_ - now);
  to_compare_ = false;
  comparing_ = {};
  for (const auto& [id, mirror] : mirrors) uncompared_.push_back(id);
}

bool Services::compare_some() {
  using Clock = std::chrono::steady_clock;
  if (uncompared_.empty()) return false;
  const auto begin = Clock::now();
  while (!uncompared_.empty() && Clock::now() < begin + Ended::kTurn) {
    if (auto* mirror = mirrors.find(uncompared_.front())) mirror->compare_clients();
    uncompared_.pop_front();
  }
  const auto now = Clock::now();
  comparing_ += now - begin;
  if (!uncompared_.empty()) return true;
  // This pause limits comparisons to a tenth of the time.
  const Duration pause = std::max<Duration>(kComparingPause, 10 * comparing_);
  compare_due_ = now + pause;
  if (to_compare_) graph_.look_again(pause);
  return false;
}

// Each look goes through all endpoints of the graph, and a robot may have hundreds of services. So
// a few clients are looked at each time, and other entities get their turns in between.
bool Services::look_at_some() {
  if (line_.empty()) return compare_some();
  using Clock = std::chrono::steady_clock;
  const auto now = Clock::now();
  bool alone = false;
  while (!line_.empty() && Clock::now() - now < Ended::kTurn) {
    const auto id = line_.front();
    line_.pop_front();
    in_line_.erase(id);
    ServiceClient* client = clients.find(id);
    if (client == nullptr) continue;
    if (auto news = client->look_for_server(now)) shared_.report(std::move(*news));
    const ServerSight& server = client->server();
    alone = alone || server.is_alone();
    if (const auto next = server.next_look()) graph_.look_again(*next);
  }
  spent_ += Clock::now() - now;
  if (line_.empty()) all_due_ = Clock::now() + 10 * std::exchange(spent_, {});
  const auto settling = now - changed_;
  if (alone && settling < kSettling)
    graph_.look_again(std::max<Duration>(kFirstLook, settling / 2));
  return !line_.empty() || !uncompared_.empty();
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
