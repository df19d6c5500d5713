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
  for (auto& [key, service] : services_)
    if (!is_real(key) && leaving_.insert(key).second) service.leave();
  for (const auto& [key, state] : all) {
    if (!is_real(key)) continue;
    // A server that is back is another one: the rest of the service without it ends first.
    if (leaving_.erase(key) > 0) {  // mutant: server_back
      services_.at(key).end(now);
      services_.erase(key);
    }
    const auto [service, is_new] = services_.try_emplace(key, key, *this);
    if (is_new) news.insert(key);
    service->second.update_servers(state, now);
  }
  end_leaving(now);
}

void LocalServices::end_leaving(const Now& now) {
  Course course{.left = graph_options.offer_ends_at_once};
  leaving_at_.reset();
  while (!leaving_.empty()) {
    const auto service = services_.find(*leaving_.begin());
    if (!service->second.end_some(course, now)) {
      leaving_at_ = now.steady;
      break;
    }
    services_.erase(service);
    leaving_.erase(leaving_.begin());
    outputs.follow_up(FollowUp::kOffers);  // its channels are free
  }
}

void LocalServices::review(Link& link, const Now& now) {
  for (auto& [key, service] : services_) service.review(link, now);
}

void LocalServices::review(Link& link, const std::string& name, const Now& now) {
  for (auto it = services_.lower_bound({name, ""});
       it != services_.end() && it->first.first == name; ++it) {
    it->second.review(link, now);
    news.insert(it->first);
  }
}

void LocalServices::go_on(const Now& now) {
  held = false;
  for (auto& [key, service] : services_) service.begin_calls(now);
}

namespace {

void open_due(LocalService& service, Link& link, Course& course, std::vector<ChannelOffer>& offers,
              const Now& now) {
  if (!service.is_due(link.id) || !link.may_offer()) return;
  course.charge(LinkOffer::kLooks);
  if (auto opened = service.offer(link, now)) offers.push_back(*std::move(opened));
}

}  // namespace

bool LocalServices::offer_all(Link& link, Course& course, std::vector<ChannelOffer>& offers,
                              const Now& now) {
  return course.each(services_,
                     [&](LocalService& service) { open_due(service, link, course, offers, now); });
}

void LocalServices::offer_one(const ServiceKey& key, Link& link, Course& course,
                              std::vector<ChannelOffer>& offers, const Now& now) {
  const auto service = services_.find(key);
  if (service != services_.end()) open_due(service->second, link, course, offers, now);
}

bool LocalServices::end_offers(LinkId link, LinkEnd& end) {
  return end.each(services_, [&](LocalService& service) { service.on_link_lost(link); });
}

void LocalServices::on_link_dead(const Link& link, const Now& now) {
  goals.on_link_dead(link.id, now.steady);
  for (auto& [key, service] : services_) service.on_link_dead(link.id, now);
  // The offers that have not ended yet refer to it.
  if (!link.loses()) loads.erase(link.id);
}

void LocalServices::on_time(const Now& now) {
  if (leaving_at_ && *leaving_at_ <= now.steady) end_leaving(now);
  std::vector<LocalService*> with_room;
  while (const auto due = timers.take_due(now.steady)) {
    const Outputs::Paying paying(outputs,
                                 due->service_offer ? due->service_offer->payer() : nullptr);
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
