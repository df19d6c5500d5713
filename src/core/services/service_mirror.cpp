#include "core/services/service_mirror.hpp"

#include <algorithm>
#include <utility>

#include "core/link/link_audit.hpp"
#include "core/link/standing.hpp"
#include "core/offers/import_right.hpp"
#include "core/policy/interface.hpp"
#include "core/services/peer_services.hpp"

namespace connect_bridge {
namespace {

// Services without a place try again after this time: places become free rarely.
constexpr Duration kPlacePacing = std::chrono::seconds(2);
// Claims last no longer than this without an answer from the peer: another bridge may reach the
// server.
constexpr Duration kAttachMax = std::chrono::seconds(10);

constexpr char kNoFeed[] = "no link offers the service any longer";

// The next common time, so that all services try again together.
TimePoint next_look(const Now& now) {
  return now.steady - now.steady.time_since_epoch() % kPlacePacing + kPlacePacing;
}

}  // namespace

ServiceMirror::ServiceMirror(ServiceKey key, PeerServices& imports)
    : imports_(imports),
      key_(std::move(key)),
      gives_results_(is_result_service(key_.first)),
      gid_(service_gid(key_.first)) {
  const auto part = part_of_action(InterfaceKind::kService, key_.first, key_.second);
  if (!part) return;
  action_ = part->action;
  gid_of_goals_ = service_gid(name_of_part(action_, ActionPart::kSendGoal));
  if (part->part == ActionPart::kSendGoal) goals_of_ = action_;
}

void ServiceMirror::appear(const Now& now) {
  imports_.update(*this, now);
}

PeerService* ServiceMirror::feeding() {
  const auto it = peer_services_.find(feeder_);
  return it == peer_services_.end() ? nullptr : &it->second;
}

bool ServiceMirror::update(const Now& now) {
  if (feeding() && feeding()->keeps_nothing()) close(kNoFeed, now);
  if (peer_services_.empty()) {
    destroy_mirror(kNoFeed, now);
    return false;
  }
  if (const LinkId next = next_feeder(); next != feeder_) {
    close("another link is called now", now);
    feeder_ = next;
  }
  if (!feeding()) return true;
  PeerService& peer_service = *feeding();
  if (!may_exist(peer_service)) {
    close("the service may not exist here any longer", now);
    return !peer_services_.empty();
  }
  if (peer_service.is_offered() && !peer_service.asked_to_attach()) {
    peer_service.attach();
    attaches_until_ = now.steady + kAttachMax;
  }
  if (mirror_) return true;
  look_.cancel();
  if (!may_be_claimed(peer_service, now)) {
    give_up_claim();
  } else if (const TimePoint settled = claim(now); settled > now.steady) {
    look_again(settled);
  } else if (!peer_service.is_attached()) {  // mutant: mirror_attached
    look_again(attaches_until_);
  } else if (!is_served_by_bridge() && may_appear(peer_service, now)) {
    create_mirror(peer_service);
  }
  return true;
}

bool ServiceMirror::may_be_claimed(const PeerService& peer_service, const Now& now) {
  if (!peer_service.is_offered()) return false;  // no calls wait for the link
  if (!peer_service.is_attached() && attaches_until_ <= now.steady) return false;
  Account& account = *peer_service.link().account;
  if (account.service_places.room() > 0) return true;
  note_waiting(peer_service);
  imports_.outputs.log_once(account.logged, LogLevel::kWarn,
                            "no place is left for more services of " + peer_service.link().label() +
                                ": not all of them exist here");
  look_again(next_look(now));
  return false;
}

TimePoint ServiceMirror::claim(const Now& now) {
  const bool claimed = claiming_.holds();
  const TimePoint settled =
      claiming_.want({*imports_.graph_since + kServiceDiscovery,
                      imports_.beside_bridges() ? kServiceSettle : Duration::zero()},
                     now);
  if (claimed != claiming_.holds()) imports_.outputs.follow_up(FollowUp::kClaim);
  return settled;
}

void ServiceMirror::give_up_claim() {
  if (claiming_.holds()) imports_.outputs.follow_up(FollowUp::kClaim);
  claiming_.give_up();
}

void ServiceMirror::look_again(TimePoint at) {
  look_ = imports_.looks.set(at, this);
}

bool ServiceMirror::may_appear(const PeerService& peer_service, const Now& now) {
  const auto answer = peer_service.link().account->mirrors.ask(*this, now.steady);
  if (answer == Appearing::Answer::kLate) note_waiting(peer_service);
  return answer == Appearing::Answer::kNow;
}

LinkId ServiceMirror::next_feeder() const {
  if (const LinkId goals = link_of_goals())
    return peer_services_.contains(goals) ? goals : LinkId{};
  const auto first_fit = [&](const auto& which) {
    const auto found =
        std::find_if(peer_services_.begin(), peer_services_.end(), [&](const auto& peer_service) {
          return peer_service.second.is_offered() && !peer_service.second.is_unfit() &&
                 which(peer_service.second.link());
        });
    return found == peer_services_.end() ? LinkId{} : found->first;
  };
  // The feeder stays as long as it can.
  auto fed = peer_services_.find(feeder_);
  if (fed == peer_services_.end() || fed->second.is_unfit()) {
    if (const LinkId fit = first_fit([](const Link&) { return true; }))
      fed = peer_services_.find(fit);
    if (fed == peer_services_.end()) fed = peer_services_.begin();
  }
  // A restarted client may have an old connection that seems alive: nobody answers on it.
  const LinkId successor =
      first_fit([&](const Link& link) { return is_successor(link, fed->second.link()); });
  return successor ? successor : fed->first;
}

LinkId ServiceMirror::link_of_goals() const {
  if (action_.empty() || !goals_of_.empty()) return {};
  const std::string goals = name_of_part(action_, ActionPart::kSendGoal);
  LinkId link;
  for (auto it = imports_.services.lower_bound({goals, ""});
       it != imports_.services.end() && it->first.first == goals; ++it) {
    const ServiceMirror& service = it->second;
    const auto peer_service = service.peer_services_.find(service.feeder_);
    if (peer_service == service.peer_services_.end() || peer_service->second.is_unfit()) continue;
    if (!link || service.mirror_) link = service.feeder_;
  }
  return link;
}

bool ServiceMirror::claims_differ() {
  const Claimed before = std::exchange(claimed_, claimed_by_others());
  return claimed_ != before;
}

ServiceMirror::Claimed ServiceMirror::claimed_by_others() const {
  const Claims& claims = imports_.claims;
  Claimed now;
  now.bridges = claims.any();
  if (!now.bridges && !claims.serves(gid_)) return now;
  now.peer_is_here = is_peer_here();
  now.taken = claims.service_taken(gid_, false);
  now.taken_first = claims.service_taken(gid_, true);
  now.served = claims.serves(gid_);
  now.goals_taken = !action_.empty() && claims.service_taken(gid_of_goals_, false);
  return now;
}

bool ServiceMirror::is_peer_here() const {
  const auto fed = peer_services_.find(feeder_);
  if (fed == peer_services_.end()) return false;
  const Connection* const connection = fed->second.link().connection();
  return connection && imports_.claims.is_here(connection->peer().side);
}

bool ServiceMirror::is_served_by_bridge() const {
  return imports_.claims.serves(gid_);
}

bool ServiceMirror::is_served_here() const {
  return !mirror_ && imports_.graph.has_server(key_.first) && !is_served_by_bridge() &&
         !is_peer_here();
}

bool ServiceMirror::may_exist(const PeerService& peer_service) {
  if (!imports_.graph_since || failed_ || peer_service.is_unfit()) return false;
  if (imports_.claims.service_taken(gid_, claiming_.holds())) return false;
  // Another bridge has the goals now, and serves their results when this mirror has ended.
  if (peer_service.keeps_results() && !link_of_goals() && !action_.empty() &&
      imports_.claims.service_taken(gid_of_goals_, false))
    return false;
  // Our own services are not in our view of the graph.
  if (node_of_parameter_service(key_.first, key_.second) == imports_.own_node ||
      is_drive_switch(key_.first, imports_.own_node))
    return false;
  // Both ends are in one graph: the peer's exports are here already.
  if (is_peer_here()) return false;
  if (!imports_.graph.has_server(key_.first)) return true;
  // The server is another bridge's, which will give way to ours or has just ended. Our mirror
  // stays, but none is made while the graph shows the other one.
  if (is_served_by_bridge()) return bool(mirror_);
  const Link& link = peer_service.link();
  imports_.outputs.log_once(link.account->logged, LogLevel::kWarn,
                            key_.first + " has a server here and one behind " + link.label() +
                                ": the one there is not mirrored");
  return false;
}

void ServiceMirror::create_mirror(const PeerService& peer_service) {
  const Outputs::Paying paying(imports_.outputs, peer_service.link().account->time);
  place_ = peer_service.link().account->service_places.hold(1);
  mirror_ = imports_.outputs.new_id<ServiceMirrorId>();
  imports_.by_mirror[mirror_] = this;
  waits_ = false;
  type_hash_ = peer_service.type_hash();
  any_definition_ = peer_service.any_definition();
  differs_ = false;
  proxy_node_ = take_proxy_node(imports_, peer_service.link(), peer_service.offer().node);
  imports_.outputs.push(CreateServiceMirror{mirror_, key_.first, key_.second, type_hash_,
                                            proxy_node_ ? *proxy_node_ : "", any_definition_});
}

void ServiceMirror::destroy_mirror(const char* why, const Now& now) {
  if (PeerService* peer_service = feeding()) peer_service->end_calls(why, now);
  give_up_claim();
  if (!mirror_) return;
  imports_.outputs.push(DestroyServiceMirror{mirror_});
  forget_mirror();
}

void ServiceMirror::forget_mirror() {
  imports_.by_mirror.erase(mirror_);
  mirror_ = {};
  place_.release();
  proxy_node_.reset();
}

void ServiceMirror::close(const char* why, const Now& now) {
  PeerService* const peer_service = feeding();
  const bool dead = peer_service && peer_service->keeps_results() && !peer_service->is_offered();
  if (peer_service) peer_service->detach();
  destroy_mirror(why, now);
  if (dead) erase_feed(std::exchange(feeder_, {}));
}

// ---- links

bool ServiceMirror::on_offer(Link& link, const ChannelOffer& offer, Decision decision,
                             const Now& now) {
  if (keeps_results(link.id) && !peer_services_.at(link.id).is_awaited_peer())
    remove_feed(link.id, "the peer logs in as somebody else", now);
  const auto [at, added] = peer_services_.try_emplace(link.id, *this, link, imports_);
  if (added) imports_.by_link[link.id].insert(this);
  PeerService& peer_service = at->second;
  if (peer_service.is_offered()) return false;
  if (feeder_ == link.id && peer_service.offer().epoch != offer.epoch &&
      !peer_service.keep_results(now))
    destroy_mirror("the peer has forgotten them", now);
  if (peer_services_.size() > 1)
    imports_.outputs.log_once(link.account->logged, LogLevel::kWarn,
                              "several links offer " + key_.first + ": one of them is called");
  peer_service.on_offer(offer, std::move(decision));
  failed_ = false;
  return true;
}

void ServiceMirror::on_policy(const Now& now) {
  for (auto it = peer_services_.begin(); it != peer_services_.end();) {
    PeerService& peer_service = (it++)->second;
    if (auto decision = import_right(imports_, peer_service.link(), InterfaceKind::kService, key_,
                                     peer_service.offer().action_type)) {
      peer_service.on_decision(std::move(*decision));
      if (peer_service.any_definition()) peer_service.set_unfit(false);
      if (feeding() == &peer_service && differs_ && !peer_service.any_definition())
        close("the type's definition differs", now);
      continue;
    }
    Link& link = peer_service.link();
    const ChannelId channel = peer_service.offer().channel;
    const Ending why = no_longer_permitted();
    if (channel) peer_service.note_end(why);
    remove_feed(link.id, "the rules no longer allow the service", now);
    if (!channel) continue;
    link.let_go(channel);
    link.decline(channel, InterfaceKind::kService, key_, why);
  }
}

bool ServiceMirror::on_link_lost(LinkId link) {
  const auto it = peer_services_.find(link);
  if (it == peer_services_.end()) return false;
  it->second.on_link_lost();
  return true;
}

void ServiceMirror::on_link_dead(LinkId link, const Now& now) {
  const auto it = peer_services_.find(link);
  if (it == peer_services_.end()) return;
  if (feeder_ == link && it->second.keep_results(now)) return;  // mutant: results_kept
  remove_feed(link, "the link has ended", now);
}

bool ServiceMirror::keeps_results(LinkId link) const {
  const auto it = peer_services_.find(link);
  return it != peer_services_.end() && it->second.keeps_results();
}

void ServiceMirror::remove_feed(LinkId link, const char* why, const Now& now) {
  if (feeder_ == link) {
    close(why, now);
    feeder_ = {};
  }
  erase_feed(link);
}

void ServiceMirror::erase_feed(LinkId link) {
  if (peer_services_.erase(link) == 0) return;
  const auto of_link = imports_.by_link.find(link);
  of_link->second.erase(this);
  if (of_link->second.empty()) imports_.by_link.erase(of_link);
}

// ---- the mirror

void ServiceMirror::on_request(RequestTaken& request, const Now& now) {
  feeding()->on_request(request.request, std::move(request.payload), now);
}

void ServiceMirror::on_callers_gone(const CallersGone& gone) {
  feeding()->on_callers_gone(gone.requests);
}

void ServiceMirror::on_mirror_failed(const ServiceMirrorFailed& failed, const Now& now) {
  PeerService* peer_service = feeding();
  const bool of_type = failed.code == "type_mismatch";
  // Changed rules may allow the type since the mirror was begun.
  const bool again = of_type && peer_service && peer_service->any_definition() && !any_definition_;
  if (!failed.hash_here.empty() && !again) log_difference(failed.hash_here, false);
  forget_mirror();
  if (again) return close("the mirror failed", now);
  if (peer_service) {
    if (failed.hash_here.empty())
      imports_.outputs.log_once(peer_service->link().account->logged, LogLevel::kError,
                                "cannot mirror " +
                                    shown(InterfaceKind::kService, key_.first, key_.second) + ": " +
                                    failed.reason);
    if (peer_service->is_offered())
      peer_service->link().decline(peer_service->offer().channel, InterfaceKind::kService, key_,
                                   {failed.reason, failed.code});
  }
  close("the mirror failed", now);
  // Another link may offer the definition that is here.
  if (of_type && feeding()) {
    feeding()->set_unfit(true);
  } else {
    failed_ = true;
  }
}

void ServiceMirror::on_type_differs(const ServiceTypeDiffers& differs, const Now& now) {
  const PeerService* peer_service = feeding();
  differs_ = true;
  log_difference(differs.hash_here, true);
  // Changed rules may forbid the type since the mirror was begun.
  if (peer_service && !peer_service->any_definition()) close("the type's definition differs", now);
}

void ServiceMirror::log_difference(const std::string& hash_here, bool used) {
  const PeerService* peer_service = feeding();
  if (!peer_service) return;
  connect_bridge::log_difference(imports_.outputs, peer_service->link(),
                                 {shown(InterfaceKind::kService, key_.first, key_.second),
                                  key_.second, hash_here, type_hash_, used});
}

void ServiceMirror::add_status(const Link& link, LinkStatus& status) const {
  const auto it = peer_services_.find(link.id);
  if (it != peer_services_.end()) it->second.add_status(status);
}

void ServiceMirror::add_channels(const Link& link, std::vector<ChannelFacts>& channels) const {
  const auto it = peer_services_.find(link.id);
  if (it != peer_services_.end()) it->second.add_channel(channels);
}

}  // namespace connect_bridge
