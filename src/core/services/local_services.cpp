#include "core/services/local_services.hpp"

#include <utility>

#include "core/policy/interface.hpp"

namespace connect_bridge {

void LocalServices::on_graph(const Now& now) {
  const auto& all = graph.services();
  const auto is_real = [&](const ServiceKey& key) {
    // A service that another bridge mirrors has its server elsewhere, whatever its node's name.
    return all.contains(key) && !claims.serves(service_gid(key.first));
  };
  for (auto it = services_.begin(); it != services_.end();) {
    const auto at = it++;
    if (is_real(at->first)) continue;
    at->second.end(now);
    services_.erase(at);
  }
  for (const auto& [key, state] : all)
    if (is_real(key))
      services_.try_emplace(key, key, *this).first->second.update_servers(state, now);
}

void LocalServices::review(Link& link, const Now& now) {
  for (auto& [key, service] : services_) service.review(link, now);
}

void LocalServices::go_on(const Now& now) {
  held = false;
  for (auto& [key, service] : services_) service.begin_calls(now);
}

void LocalServices::collect_offers(Link& link, std::vector<ChannelOffer>& offers, const Now& now) {
  for (auto& [key, service] : services_)
    if (auto offer = link.may_offer() ? service.offer(link, now) : std::nullopt)
      offers.push_back(std::move(*offer));
}

void LocalServices::on_link_lost(LinkId link, const Now& now) {
  goals.on_link_lost(link, now.steady);
  for (auto& [key, service] : services_) service.on_link_lost(link);
}

void LocalServices::on_link_dead(LinkId link, const Now& now) {
  goals.on_link_dead(link, now.steady);
  for (auto& [key, service] : services_) service.on_link_dead(link, now);
  loads.erase(link);
}

void LocalServices::on_time(const Now& now) {
  std::vector<LocalService*> with_room;
  while (const auto due = timers.take_due(now.steady)) {
    if (due->call) {
      due->service_offer->on_timeout(*due->call, now);
    } else if (due->service_offer) {
      due->service_offer->detach("the peer does not attach the service again", now);
    }
    with_room.push_back(due->service);
  }
  // Last, so that no call begins that ends in the same input.
  for (LocalService* const service : with_room) service->begin_calls(now);
  for (const SentGoal& goal : goals.take_due(now.steady)) cancel(goal);
}

void LocalServices::cancel(const SentGoal& goal) {
  const std::string name = name_of_part(goal.action, ActionPart::kCancelGoal);
  const auto service = services_.lower_bound({name, ""});
  if (service == services_.end() || service->first.first != name) return;
  outputs.log(LogLevel::kInfo, "asks to cancel a goal of " + goal.sender.owner + " at " +
                                   goal.action +
                                   ": its link is lost, and has not come back within cancel_after");
  service->second.cancel(goal);
}

void LocalServices::add_status(const Link& link, LinkStatus& status) const {
  for (const auto& [key, service] : services_) service.add_status(link, status);
}

void LocalServices::add_channels(const Link& link, std::vector<ChannelFacts>& channels) const {
  for (const auto& [key, service] : services_) service.add_channels(link, channels);
}

}  // namespace connect_bridge
