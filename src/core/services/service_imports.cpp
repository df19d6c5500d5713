#include "core/services/service_imports.hpp"

#include <algorithm>

#include "core/offers/import_right.hpp"

namespace connect_bridge {
namespace {

// Types with which an identity may offer a service of one name. A real one has one type, or for a
// moment two; the services of an action are looked at together, each with all its types.
constexpr std::size_t kTypesOfServiceMax = 4;

bool has_too_many_types(const Mirroring& mirroring, const Link& link, const ServiceKey& key) {
  std::size_t others = 0;
  for (auto it = mirroring.services.lower_bound({key.first, ""});
       it != mirroring.services.end() && it->first.first == key.first; ++it) {
    const auto& feeds = it->second->feeds();
    if (it->first != key && std::any_of(feeds.begin(), feeds.end(), [&](const auto& feed) {
          return feed.second.link().account == link.account;
        }))
      ++others;
  }
  return others >= kTypesOfServiceMax;
}

}  // namespace

void ServiceImports::on_offer(Link& link, const ChannelOffer& offer, const Now& now) {
  auto import = judge(mirroring_, link, offer);
  if (!import) return;
  const ServiceKey& key = import->key;
  // Before an entry is made: a peer could offer one name with types without end.
  if (has_too_many_types(mirroring_, link, key))
    return decline(mirroring_, link, offer, "limit", "its name is offered with too many types");
  auto& service = mirroring_.services[key];
  if (!service) service = std::make_unique<MirroredService>(key, mirroring_);
  if (!service->on_offer(link, offer, import->decision))
    return decline(mirroring_, link, offer, "failed", "this service is offered twice");
  note_import(mirroring_, link, offer, import->decision.rule);
  mirroring_.update(*service, now);
}

void ServiceImports::forget_orphans(LinkId link, const Now& now) {
  for (auto it = mirroring_.services.begin(); it != mirroring_.services.end();) {
    MirroredService& service = *(it++)->second;
    if (service.forget_orphan(link)) mirroring_.update(service, now);
  }
}

void ServiceImports::on_link_lost(LinkId link, const Now& now) {
  for (auto it = mirroring_.services.begin(); it != mirroring_.services.end();) {
    MirroredService& service = *(it++)->second;
    // What has no mirror yet is claimed no longer: another bridge may have it.
    if (service.on_link_lost(link)) mirroring_.update(service, now);
  }
}

void ServiceImports::on_link_dead(LinkId link, const Now& now) {
  for (auto it = mirroring_.services.begin(); it != mirroring_.services.end();) {
    MirroredService& service = *(it++)->second;
    if (service.on_link_dead(link)) mirroring_.update(service, now);
  }
  // Last: the calls that have ended now gave back to it.
  mirroring_.loads.erase(link);
}

void ServiceImports::on_graph(const Now& now) {
  if (!mirroring_.graph_since) mirroring_.graph_since = now.steady;
  mirroring_.update_all(now);
}

void ServiceImports::on_claims(const Now& now) {
  mirroring_.update_all(now);
}

void ServiceImports::on_lapse(const Now& now) {
  if (!mirroring_.graph_since) return;
  mirroring_.graph_since = now.steady;
  for (auto& [key, service] : mirroring_.services) service->on_lapse();
  mirroring_.update_all(now);
}

void ServiceImports::on_policy(const Now& now) {
  for (auto it = mirroring_.services.begin(); it != mirroring_.services.end();) {
    MirroredService& service = *(it++)->second;
    service.on_policy();
    mirroring_.update(service, now);
  }
}

// The mirror may have been destroyed just now.
MirroredService* ServiceImports::find(ServiceMirrorId mirror) const {
  const auto it = mirroring_.by_mirror.find(mirror);
  return it == mirroring_.by_mirror.end() ? nullptr : it->second;
}

const std::string* ServiceImports::goals_of(ServiceMirrorId mirror) const {
  const auto* service = find(mirror);
  return service && !service->goals_of().empty() ? &service->goals_of() : nullptr;
}

void ServiceImports::on_request(RequestTaken& request, const Now& now) {
  if (auto* service = find(request.mirror)) service->on_request(request, now);
}

void ServiceImports::on_callers_gone(const CallersGone& gone) {
  if (auto* service = find(gone.mirror)) service->on_callers_gone(gone);
}

void ServiceImports::on_mirror_failed(const ServiceMirrorFailed& failed, const Now& now) {
  auto* service = find(failed.id);
  if (!service) return;
  service->on_mirror_failed(failed);
  mirroring_.update(*service, now);
}

void ServiceImports::on_type_differs(const ServiceTypeDiffers& differs, const Now& now) {
  auto* service = find(differs.id);
  if (!service) return;
  service->on_type_differs(differs);
  mirroring_.update(*service, now);
}

void ServiceImports::on_time(const Now& now) {
  while (const auto call = mirroring_.timers.take_due(now.steady))
    (*call)->feed().on_timeout(**call, now);
  if (!mirroring_.settles_at || *mirroring_.settles_at > now.steady) return;
  mirroring_.update_due(now);
}

std::optional<TimePoint> ServiceImports::deadline() const {
  return earliest(mirroring_.settles_at, mirroring_.timers.deadline());
}

void ServiceImports::add_mirrored(Claim& claim) const {
  for (const auto& [key, service] : mirroring_.services)
    if (service->is_claimed()) claim.services.push_back(service_gid(key.first));
}

bool ServiceImports::has_mirror(const ServiceKey& key) const {
  const auto found = mirroring_.services.find(key);
  return found != mirroring_.services.end() && found->second->mirror();
}

void ServiceImports::add_status(const Link& link, LinkStatus& status) const {
  for (const auto& [key, service] : mirroring_.services) service->add_status(link, status);
}

std::uint64_t ServiceImports::memory_bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [id, load] : mirroring_.loads)
    bytes += load.request_bytes.used() + load.decoding_bytes.used();
  return bytes;
}

}  // namespace connect_bridge
