#include "core/services/mirrored_service.hpp"

#include <algorithm>
#include <utility>

#include "core/link/link_audit.hpp"
#include "core/link/standing.hpp"
#include "core/offers/import_right.hpp"
#include "core/policy/interface.hpp"
#include "core/services/service_imports.hpp"

namespace connect_bridge {
namespace {

// A service without a place asks again after this time: places become free rarely.
constexpr Duration kPlacePacing = std::chrono::seconds(2);
// A claim is no more than this without an answer from the peer: another bridge may reach the
// server.
constexpr Duration kAttachMax = std::chrono::seconds(10);

// All of them look again together.
TimePoint next_look(const Now& now) {
  return now.steady - now.steady.time_since_epoch() % kPlacePacing + kPlacePacing;
}

}  // namespace

MirroredService::MirroredService(ServiceKey key, ServiceImports& imports)
    : imports_(imports), key_(std::move(key)), gives_results_(is_result_service(key_.first)) {
  const auto part = part_of_action(InterfaceKind::kService, key_.first, key_.second);
  if (!part) return;
  action_ = part->action;
  if (part->part == ActionPart::kSendGoal) goals_of_ = action_;
}

void MirroredService::appear(const Now& now) {
  imports_.update(*this, now);
}

Feed* MirroredService::feeding() {
  const auto it = feeds_.find(feeder_);
  return it == feeds_.end() ? nullptr : &it->second;
}

bool MirroredService::update(const Now& now) {
  if (feeds_.empty()) {
    destroy_mirror();
    return false;
  }
  if (const LinkId next = next_feeder(); next != feeder_) {
    close();
    feeder_ = next;
  }
  if (!feeding()) return true;
  Feed& feed = *feeding();
  if (!may_exist(feed)) {
    close();
    return true;
  }
  if (feed.is_offered() && !feed.asked_to_attach()) {
    feed.attach();
    attaches_until_ = now.steady + kAttachMax;
  }
  if (mirror_) return true;
  look_.cancel();
  if (!may_be_claimed(feed, now)) {
    give_up_claim();
  } else if (const TimePoint settled = claim(now); settled > now.steady) {
    look_again(settled);
  } else if (!feed.is_attached()) {  // mutant: mirror_attached
    look_again(attaches_until_);
  } else if (!is_served_by_bridge() && may_appear(feed, now)) {
    create_mirror(feed);
  }
  return true;
}

bool MirroredService::may_be_claimed(const Feed& feed, const Now& now) {
  if (!feed.is_offered()) return false;  // there are no calls that wait for the link's return
  if (!feed.is_attached() && attaches_until_ <= now.steady) return false;
  Account& account = *feed.link().account;
  if (account.service_places.room() > 0) return true;
  note_waiting(feed);
  imports_.outputs.log_once(account.told, LogLevel::kWarn,
                            "no place is left for more services of " + feed.link().label() +
                                ": not all of them exist here");
  look_again(next_look(now));
  return false;
}

TimePoint MirroredService::claim(const Now& now) {
  const bool claimed = claiming_.holds();
  const TimePoint settled =
      claiming_.want({*imports_.graph_since + kServiceDiscovery,
                      imports_.beside_bridges() ? kServiceSettle : Duration::zero()},
                     now);
  if (claimed != claiming_.holds()) imports_.outputs.follow_up(FollowUp::kClaim);
  return settled;
}

void MirroredService::give_up_claim() {
  if (claiming_.holds()) imports_.outputs.follow_up(FollowUp::kClaim);
  claiming_.give_up();
}

void MirroredService::look_again(TimePoint at) {
  look_ = imports_.looks.set(at, this);
}

bool MirroredService::may_appear(const Feed& feed, const Now& now) {
  const auto answer = feed.link().account->mirrors.ask(*this, now.steady);
  if (answer == Appearing::Answer::kLate) note_waiting(feed);
  return answer == Appearing::Answer::kNow;
}

LinkId MirroredService::next_feeder() const {
  if (const LinkId goals = link_of_goals()) return feeds_.contains(goals) ? goals : LinkId{};
  const auto first_fit = [&](const auto& which) {
    const auto found = std::find_if(feeds_.begin(), feeds_.end(), [&](const auto& feed) {
      return feed.second.is_offered() && !feed.second.is_unfit() && which(feed.second.link());
    });
    return found == feeds_.end() ? LinkId{} : found->first;
  };
  // The feeder stays as long as it can be one.
  auto fed = feeds_.find(feeder_);
  if (fed == feeds_.end() || fed->second.is_unfit()) {
    if (const LinkId fit = first_fit([](const Link&) { return true; })) fed = feeds_.find(fit);
    if (fed == feeds_.end()) fed = feeds_.begin();
  }
  // A client that was restarted while its old connection seems alive: nobody answers on that.
  const LinkId successor =
      first_fit([&](const Link& link) { return is_successor(link, fed->second.link()); });
  return successor ? successor : fed->first;
}

LinkId MirroredService::link_of_goals() const {
  if (action_.empty() || !goals_of_.empty()) return {};
  const std::string goals = name_of_part(action_, ActionPart::kSendGoal);
  LinkId link;
  for (auto it = imports_.services.lower_bound({goals, ""});
       it != imports_.services.end() && it->first.first == goals; ++it) {
    const MirroredService& service = it->second;
    const auto feed = service.feeds_.find(service.feeder_);
    if (feed == service.feeds_.end() || feed->second.is_unfit()) continue;
    if (!link || service.mirror_) link = service.feeder_;
  }
  return link;
}

bool MirroredService::is_served_by_bridge() const {
  return imports_.claims.serves(service_gid(key_.first));
}

bool MirroredService::may_exist(const Feed& feed) {
  if (!imports_.graph_since || failed_ || feed.is_unfit()) return false;
  if (imports_.claims.service_taken(service_gid(key_.first), claiming_.holds())) return false;
  // Our own services are not in our view of the graph.
  if (node_of_parameter_service(key_.first, key_.second) == imports_.own_node) return false;
  // Both ends are in one graph: what the peer exports is here already.
  const Link& link = feed.link();
  if (link.connection() && imports_.claims.is_here(link.connection()->peer().side)) return false;
  if (!imports_.graph.has_server(key_.first)) return true;
  // It is another bridge's, which is about to give way to ours, or has just ended. Ours stays, and
  // is not made as long as the graph shows the other one.
  if (is_served_by_bridge()) return bool(mirror_);
  imports_.outputs.log_once(link.account->told, LogLevel::kWarn,
                            key_.first + " has a server here and one behind " + link.label() +
                                ": the one there is not mirrored");
  return false;
}

void MirroredService::create_mirror(const Feed& feed) {
  const Outputs::Paying paying(imports_.outputs, feed.link().account->time);
  place_ = feed.link().account->service_places.hold(1);
  mirror_ = imports_.outputs.new_id<ServiceMirrorId>();
  imports_.by_mirror[mirror_] = this;
  waits_ = false;
  type_hash_ = feed.type_hash();
  any_definition_ = feed.any_definition();
  differs_ = false;
  imports_.outputs.push(CreateServiceMirror{
      mirror_, key_.first, key_.second, type_hash_,
      imports_.graph_options.owner_of(feed.offer().node, feed.link().names), any_definition_});
}

void MirroredService::destroy_mirror() {
  if (Feed* feed = feeding()) feed->end_calls();
  give_up_claim();
  if (!mirror_) return;
  imports_.outputs.push(DestroyServiceMirror{mirror_});
  forget_mirror();
}

void MirroredService::forget_mirror() {
  imports_.by_mirror.erase(mirror_);
  mirror_ = {};
  place_.release();
}

void MirroredService::close() {
  if (Feed* feed = feeding()) feed->detach();
  destroy_mirror();
}

// ---- links

bool MirroredService::on_offer(Link& link, const ChannelOffer& offer, Decision decision) {
  Feed& feed = feeds_.try_emplace(link.id, *this, link, imports_).first->second;
  if (feed.is_offered()) return false;
  if (feeder_ == link.id && feed.offer().epoch != offer.epoch) destroy_mirror();
  if (feeds_.size() > 1)
    imports_.outputs.log_once(link.account->told, LogLevel::kWarn,
                              "several links offer " + key_.first + ": one of them is called");
  feed.on_offer(offer, std::move(decision));
  failed_ = false;
  return true;
}

void MirroredService::on_policy() {
  for (auto it = feeds_.begin(); it != feeds_.end();) {
    Feed& feed = (it++)->second;
    if (auto decision = import_right(imports_, feed.link(), InterfaceKind::kService, key_,
                                     feed.offer().action_type)) {
      feed.on_decision(std::move(*decision));
      if (feed.any_definition()) feed.set_unfit(false);
      if (feeding() == &feed && differs_ && !feed.any_definition()) close();
      continue;
    }
    Link& link = feed.link();
    const ChannelId channel = feed.offer().channel;
    const Ending why = no_longer_permitted();
    if (channel) feed.note_end(why);
    remove_feed(link.id);
    if (!channel) continue;
    link.let_go(channel);
    link.decline(channel, InterfaceKind::kService, key_, why);
  }
}

bool MirroredService::on_link_lost(LinkId link) {
  const auto it = feeds_.find(link);
  if (it == feeds_.end()) return false;
  it->second.on_link_lost();
  return true;
}

bool MirroredService::remove_feed(LinkId link) {
  if (feeder_ == link) {
    close();
    feeder_ = {};
  }
  return feeds_.erase(link) > 0;
}

// ---- the mirror

void MirroredService::on_request(RequestTaken& request, const Now& now) {
  feeding()->on_request(request.request, std::move(request.payload), now);
}

void MirroredService::on_callers_gone(const CallersGone& gone) {
  feeding()->on_callers_gone(gone.requests);
}

void MirroredService::on_mirror_failed(const ServiceMirrorFailed& failed) {
  Feed* feed = feeding();
  const bool of_type = failed.code == "type_mismatch";
  // The rules may allow it since it was begun.
  const bool again = of_type && feed && feed->any_definition() && !any_definition_;
  if (!failed.hash_here.empty() && !again) log_difference(failed.hash_here, false);
  forget_mirror();
  if (again) return close();
  if (feed) {
    if (failed.hash_here.empty())
      imports_.outputs.log_once(feed->link().account->told, LogLevel::kError,
                                "cannot mirror " +
                                    shown(InterfaceKind::kService, key_.first, key_.second) + ": " +
                                    failed.reason);
    if (feed->is_offered())
      feed->link().decline(feed->offer().channel, InterfaceKind::kService, key_,
                           {failed.reason, failed.code});
  }
  close();
  // Another link may offer the definition that is here.
  if (of_type && feed) {
    feed->set_unfit(true);
  } else {
    failed_ = true;
  }
}

void MirroredService::on_type_differs(const ServiceTypeDiffers& differs) {
  const Feed* feed = feeding();
  differs_ = true;
  log_difference(differs.hash_here, true);
  // The rules may have changed since it was begun.
  if (feed && !feed->any_definition()) close();
}

void MirroredService::log_difference(const std::string& hash_here, bool used) {
  const Feed* feed = feeding();
  if (!feed) return;
  connect_bridge::log_difference(imports_.outputs, feed->link(),
                                 {shown(InterfaceKind::kService, key_.first, key_.second),
                                  key_.second, hash_here, type_hash_, used});
}

void MirroredService::add_status(const Link& link, LinkStatus& status) const {
  const auto it = feeds_.find(link.id);
  if (it != feeds_.end()) it->second.add_status(status);
}

}  // namespace connect_bridge
