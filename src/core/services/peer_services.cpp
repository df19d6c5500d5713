#include "core/services/peer_services.hpp"

#include <algorithm>

#include "core/offers/import_right.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

// Types with which an identity may offer a service of one name. A real service has one type, or two
// for a moment. The services of an action are checked together, each with all its types.
constexpr std::size_t kTypesOfServiceMax = 4;
// Thousands may be without a place, and look again together: the others' turns are in between.
constexpr int kServicesAtOnce = 64;

bool has_too_many_types(const PeerServices& imports, const Link& link, const ServiceKey& key) {
  std::size_t others = 0;
  for (auto it = imports.services.lower_bound({key.first, ""});
       it != imports.services.end() && it->first.first == key.first; ++it) {
    const auto& peer_services = it->second.feeds();
    if (it->first != key &&
        std::any_of(peer_services.begin(), peer_services.end(), [&](const auto& peer_service) {
          return peer_service.second.link().account == link.account;
        }))
      ++others;
  }
  return others >= kTypesOfServiceMax;
}

}  // namespace

// ---- updates

void PeerServices::update(ServiceMirror& service, const Now& now) {
  // Cancels and results of an action move together with its goals to another link: a cancel that
  // goes to another robot stops nothing. The recursion ends, because only a service of goals starts
  // it, and only when it moves. The name is read before the service may be destroyed.
  const LinkId before = service.feeder();
  ++updated_;
  const bool stays = service.update(now);
  const std::string moved = stays && service.feeder() == before ? "" : service.goals_of();
  if (stays) {
    static_cast<void>(service.claims_differ());  // the update has asked for them
  } else {
    services.erase(ServiceKey(service.key()));
  }
  if (moved.empty()) return;
  for (const ActionPart part : kActionParts) {
    if (kind_of(part) != InterfaceKind::kService) continue;
    update_named(name_of_part(moved, part), now);
  }
}

void PeerServices::update_named(const std::string& name, const Now& now) {
  for (auto it = services.lower_bound({name, ""}); it != services.end() && it->first.first == name;)
    update((it++)->second, now);
}

// An update may destroy its service, and those of its action that nobody offers any longer.
template <class Change>
void PeerServices::update_each(const Change& change, const Now& now) {
  for (auto it = services.begin(); it != services.end();) {
    if (!change(it->second)) {
      ++it;
      continue;
    }
    const ServiceKey key = it->first;
    update(it->second, now);
    it = services.upper_bound(key);
  }
}

template <class Change>
bool PeerServices::update_of(LinkId link, LinkEnd& end, const Change& change, const Now& now) {
  for (;;) {
    const auto of_link = by_link.find(link);
    if (of_link == by_link.end()) return true;
    const auto next = of_link->second.upper_bound(end.last);
    if (next == of_link->second.end()) return true;
    if (!end.take()) return false;
    ServiceMirror& service = **next;
    end.last = service.key();
    if (change(service)) update(service, now);
  }
}

void PeerServices::on_offer(Link& link, const ChannelOffer& offer, const Now& now) {
  auto import = judge(*this, link, offer);
  if (!import) return;
  const ServiceKey& key = import->key;
  // The check precedes the new entry: a peer could offer one name with types without end.
  if (has_too_many_types(*this, link, key))
    return decline(*this, link, offer, "limit", "its name is offered with too many types");
  ServiceMirror& service = services.try_emplace(key, key, *this).first->second;
  if (!service.on_offer(link, offer, import->decision, now))
    return decline(*this, link, offer, "failed", "this service is offered twice");
  note_import(*this, link, offer, import->decision.rule);
  update(service, now);
}

void PeerServices::forget_orphans(LinkId link, const Now& now) {
  const auto remove = [&](ServiceMirror& service) {
    const auto feed = service.feeds().find(link);
    if (feed == service.feeds().end() || feed->second.is_offered()) return false;
    service.remove_feed(link, "the peer does not offer the service again", now);
    return true;
  };
  LinkEnd all;
  update_of(link, all, remove, now);
}

// Services without a mirror give up their claim: another bridge may take them.
bool PeerServices::on_link_lost(LinkId link, LinkEnd& end, const Now& now) {
  const auto lose = [&](ServiceMirror& service) { return service.on_link_lost(link); };
  return update_of(link, end, lose, now);
}

bool PeerServices::on_link_dead(LinkId link, LinkEnd& end, const Now& now) {
  const auto remove = [&](ServiceMirror& service) {
    service.on_link_dead(link, now);
    return true;
  };
  if (!update_of(link, end, remove, now)) return false;
  // Last: the calls that have ended now gave their bytes back to it.
  if (!keeps(link)) loads.erase(link);
  return true;
}

bool PeerServices::keeps(LinkId link) const {
  const auto of_link = by_link.find(link);
  return of_link != by_link.end() &&
         std::any_of(of_link->second.begin(), of_link->second.end(),
                     [&](const ServiceMirror* service) { return service->keeps_results(link); });
}

void PeerServices::on_link_forgotten(LinkId link, const Now& now) {
  const auto remove = [&](ServiceMirror& service) {
    if (!service.keeps_results(link)) return false;
    service.remove_feed(link, "the peer has not returned, or was started again", now);
    return true;
  };
  LinkEnd all;
  update_of(link, all, remove, now);
  loads.erase(link);
}

void PeerServices::on_graph(const Now& now, const GraphDifference& difference) {
  const bool all = difference.all || !graph_since;
  if (!graph_since) graph_since = now.steady;
  if (all) return update_each([](ServiceMirror&) { return true; }, now);
  for (const std::string& name : difference.served) update_named(name, now);
}

void PeerServices::on_claims(const Now& now) {
  update_each([](ServiceMirror& service) { return service.claims_differ(); }, now);
}

void PeerServices::on_lapse(const Now& now) {
  if (!graph_since) return;
  graph_since = now.steady;
  const auto close = [&](ServiceMirror& service) {
    service.close("another bridge may serve it now", now);
    return true;
  };
  update_each(close, now);
}

void PeerServices::on_policy(const Now& now) {
  const auto judge_again = [&](ServiceMirror& service) {
    service.on_policy(now);
    return true;
  };
  update_each(judge_again, now);
}

// Null: the mirror may have been destroyed just now.
ServiceMirror* PeerServices::find(ServiceMirrorId mirror) const {
  const auto it = by_mirror.find(mirror);
  return it == by_mirror.end() ? nullptr : it->second;
}

const std::string* PeerServices::goals_of(ServiceMirrorId mirror) const {
  const auto* service = find(mirror);
  return service && !service->goals_of().empty() ? &service->goals_of() : nullptr;
}

void PeerServices::on_request(RequestTaken& request, const Now& now) {
  if (auto* service = find(request.mirror)) service->on_request(request, now);
}

void PeerServices::on_callers_gone(const CallersGone& gone, const Now& now) {
  auto* service = find(gone.mirror);
  if (!service) return;
  service->on_callers_gone(gone);
  update(*service, now);
}

void PeerServices::on_mirror_failed(const ServiceMirrorFailed& failed, const Now& now) {
  auto* service = find(failed.id);
  if (!service) return;
  service->on_mirror_failed(failed, now);
  update(*service, now);
}

void PeerServices::on_type_differs(const ServiceTypeDiffers& differs, const Now& now) {
  auto* service = find(differs.id);
  if (!service) return;
  service->on_type_differs(differs, now);
  update(*service, now);
}

void PeerServices::on_time(const Now& now) {
  while (const auto call = timers.take_due(now.steady)) {
    PeerService& feed = (*call)->feed();
    const Outputs::Paying paying(outputs, feed.link().account->time);
    feed.on_due(**call, now);
  }
  for (int n = 0; n < kServicesAtOnce; ++n) {
    const auto service = looks.take_due(now.steady);
    if (!service) break;
    const auto& feeds = (*service)->feeds();
    const Outputs::Paying paying(
        outputs, feeds.empty() ? nullptr : feeds.begin()->second.link().account->time);
    update(**service, now);
  }
}

void PeerServices::add_mirrored(Claim& claim) const {
  for (const auto& [key, service] : services)
    if (service.is_claimed()) claim.services.push_back(service.gid());
}

bool PeerServices::has_mirror(const ServiceKey& key) const {
  const auto found = services.find(key);
  return found != services.end() && found->second.mirror();
}

void PeerServices::add_status(const Link& link, LinkStatus& status) const {
  const auto of_link = by_link.find(link.id);
  if (of_link == by_link.end()) return;
  for (const ServiceMirror* service : of_link->second) service->add_status(link, status);
}

void PeerServices::add_channels(const Link& link, std::vector<ChannelFacts>& channels) const {
  const auto of_link = by_link.find(link.id);
  if (of_link == by_link.end()) return;
  for (const ServiceMirror* service : of_link->second) service->add_channels(link, channels);
}

}  // namespace connect_bridge
