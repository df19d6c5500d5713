#include "core/services/service_exports.hpp"

namespace connect_bridge {

void ServiceExports::on_graph(const Now& now) {
  const auto& all = serving_.graph.services();
  const auto is_real = [&](const ServiceKey& key) {
    // A service that another bridge mirrors has its server elsewhere, whatever the name of its
    // node.
    return all.contains(key) && !serving_.claims.serves(service_gid(key.first));
  };
  for (auto it = services_.begin(); it != services_.end();) {
    const auto at = it++;
    if (is_real(at->first)) continue;
    at->second.end(now);
    services_.erase(at);
  }
  for (const auto& [key, state] : all)
    if (is_real(key))
      services_.try_emplace(key, key, serving_).first->second.update_servers(state, now);
}

void ServiceExports::review(Link& link, const Now& now) {
  for (auto& [key, service] : services_) service.review(link, now);
}

void ServiceExports::go_on(const Now& now) {
  serving_.gate.release();
  serving_.begin_calls(now);
}

void ServiceExports::collect_offers(Link& link, std::vector<ChannelOffer>& offers, const Now& now) {
  for (auto& [key, service] : services_)
    if (auto offer = link.may_offer() ? service.offer(link, now) : std::nullopt)
      offers.push_back(std::move(*offer));
}

void ServiceExports::on_link_lost(LinkId link) {
  for (auto& [key, service] : services_) service.on_link_lost(link);
}

void ServiceExports::on_link_dead(LinkId link, const Now& now) {
  for (auto& [key, service] : services_) service.on_link_dead(link, now);
  serving_.loads.erase(link);
}

void ServiceExports::on_time(const Now& now) {
  while (const auto due = serving_.timers.take_due(now.steady)) {
    if (due->call) {
      due->attachment->on_timeout(*due->call, now);
    } else {
      due->attachment->detach(now);
    }
  }
  serving_.begin_calls(now);  // last, so that no call begins that ends in the same input
  serving_.gate.expire(now.steady);
  serving_.begin_calls(now);
}

std::optional<TimePoint> ServiceExports::deadline() const {
  return earliest(serving_.timers.deadline(), serving_.gate.deadline());
}

void ServiceExports::add_status(const Link& link, LinkStatus& status) const {
  for (const auto& [key, service] : services_) service.add_status(link, status);
}

std::uint64_t ServiceExports::memory_bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [id, load] : serving_.loads)
    bytes += load.request_bytes.used() + load.answer_bytes.used();
  return bytes;
}

}  // namespace connect_bridge
