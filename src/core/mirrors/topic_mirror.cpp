#include "core/mirrors/topic_mirror.hpp"

#include <bit>

#include "core/link/link_audit.hpp"
#include "core/link/standing.hpp"
#include "core/mirrors/import_context.hpp"
#include "core/mirrors/peer_topic.hpp"
#include "core/offers/import_right.hpp"
#include "core/policy/interface.hpp"
#include "core/topics/topic_qos.hpp"

namespace connect_bridge {
namespace {

// A mirror whose origin is gone stays this long, so that the middleware delivers its last samples.
constexpr Duration kMirrorLinger = std::chrono::milliseconds(200);
// Within this time the graph shows the subscriptions of an action's client.
constexpr Duration kGoalDemand = std::chrono::seconds(5);
// By then a graph knows a node's name, if ever; first samples are kept longer (early_samples.hpp).
constexpr Duration kNaming = std::chrono::seconds(1);
// A mirror that could not be made, for another reason than its definition, is tried again: its name
// may have had another type here.
constexpr Duration kRetry = std::chrono::seconds(30);
// A mirror that needs the origin's last samples again wants no data for this long, so that several
// changes share one pause.
constexpr Duration kPause = std::chrono::milliseconds(250);
// By then subscribers have found a publisher that was made again; messages that the peer kept for
// them must not come earlier. Five processes on a busy machine took 1 ms mostly, and 105 ms at
// most.
constexpr Duration kMatching = std::chrono::milliseconds(200);
// A graph knows an endpoint before the name of its node, if that ever has one.
constexpr Duration kSubscriberNaming = std::chrono::seconds(2);

}  // namespace

TopicMirror::TopicMirror(ImportContext& context, MirrorKey key)
    : context_(context), key_(std::move(key)), first_({context.mirrors.timers(), this}) {}

Timers<TopicMirror*>& TopicMirror::timers() const {
  return context_.mirrors.timers();
}

// ---- the links that offer the origin

bool TopicMirror::add_candidate(PeerTopic& offered, const OriginOffer& origin) {
  Link& link = offered.link();
  MirrorCandidate* own = find_candidate(candidates_, link.id);
  if (!own) {
    candidates_.push_back({&link, &offered, false, origin.qos});
    link.mirrors.add(key_.first);
    // A client was restarted while its old connection seems alive: nothing comes on the old one.
    if (is_successor(link, *candidates_.front().link))
      std::swap(candidates_.front(), candidates_.back());
    charge();
  } else if (!own->offered) {
    *own = {&link, &offered, false, origin.qos};
  } else {
    return false;
  }
  ends_.cancel();
  if (std::exchange(failed_, false)) retries_.cancel();
  // Another link may have sent the node's name already.
  const std::string node = origin.node.empty() ? origin_.node : origin.node;
  const bool moved = context_.graph_options.proxy_nodes && origin_.node != node;
  origin_ = origin;
  origin_.node = node;
  if (id_ && moved) destroy();
  return true;
}

// The mirror follows the feeding link's offer and the rules for that link. It takes nothing from
// another link, which may be allowed more.
bool TopicMirror::follow_feeder() {
  if (!feeder()) return false;
  action_type_ = feeder()->action_type();
  origin_.qos = candidates_.front().qos;
  const Qos qos = mirror_qos(origin_.qos, feeder()->treatment().qos, context_.options);
  const bool same_type = is_of_its_type(*feeder());
  if (qos == qos_ && same_type) return false;
  destroy();
  if (!same_type && std::exchange(failed_, false)) retries_.cancel();
  type_hash_ = feeder()->type_hash();
  any_definition_ = feeder()->treatment().allow_type_mismatch;
  qos_ = qos;
  return true;
}

bool TopicMirror::is_latched() const {
  return feeder() && come_again(origin_.qos, feeder()->treatment(), key_.first);
}

bool TopicMirror::is_of_its_type(const PeerTopic& offered) const {
  return offered.type_hash() == type_hash_ &&
         offered.treatment().allow_type_mismatch == any_definition_;
}

// A mirror on a proxy node is made, or made again, when its origin's node has a name.
void TopicMirror::name_node(const std::string& node, const Now& now) {
  if (node.empty() || !origin_.node.empty()) return;
  origin_.node = node;
  if (!context_.graph_options.proxy_nodes) return warn_incompatible(now);
  if (id_) destroy();
  update(now);
}

void TopicMirror::lose_topic(LinkId link, const Now& now) {
  if (MirrorCandidate* lost = find_candidate(candidates_, link))
    wish_.forget(std::exchange(lost->offered, nullptr));
  update(now);
}

void TopicMirror::remove_candidate(LinkId link, const Now& now) {
  const bool fed = candidates_.front().link->id == link;
  wish_.forget(candidate(link)->offered);
  candidate(link)->link->mirrors.remove(key_.first);
  std::erase_if(candidates_, [&](const MirrorCandidate& c) { return c.link->id == link; });
  charge();
  if (candidates_.empty()) {
    if (!id_) give_up_claim();
    const TimePoint lingers = now.steady + kMirrorLinger;
    ends_ = timers().set(std::max(lingers, context_.wheels.needs(*this).value_or(lingers)), this);
    return;
  }
  const bool taken_over = refresh(now);
  if (fed || taken_over) ask_for_last_samples(now);
}

void TopicMirror::lose_link(LinkId link) {
  Link& lost = *candidate(link)->link;
  if (candidates_.size() > 1) return static_cast<void>(lost.arrived.erase(key_.first));
  note_end(lost.arrived, key_.first, key_.second, lost.memory);
  note_published(lost);
  // Subscribers here may miss a zero of a publisher that ends at once.
  if (!context_.wheels.needs(*this)) vanish();  // mutant: mirror_of_a_halt
}

void TopicMirror::note_published(Link& lost) const {
  const TopicState* topic = context_.graph.find(key_.first);
  // Messages that wait for their subscribers may still be dropped.
  const std::uint64_t number = first_.empty() ? last_number_ : before_first_;
  if (!id_ || number == 0 || !is_transient_local(origin_.qos) || !topic ||
      topic->subscribers.size() > Published::kSubscribersMax)
    return;
  std::set<Gid> reached;
  for (const auto& subscriber : topic->subscribers) reached.insert(subscriber.gid);
  lost.published.note(key_, {number, std::move(reached)}, lost.memory);
}

bool TopicMirror::misses_samples() const {
  if (!id_ || reached_.empty() || fresh_ >= depth()) return false;  // mutant: fresh_samples
  const TopicState* topic = context_.graph.find(key_.first);
  // A volatile subscriber gets no samples from before its time.
  return topic && std::any_of(topic->subscribers.begin(), topic->subscribers.end(),
                              [&](const auto& subscriber) {
                                return is_transient_local(subscriber.qos) &&
                                       !reached_.contains(subscriber.gid);
                              });
}

// ---- feeding, creation and destruction

// The first candidate feeds the mirror for as long as it can: every change of the feeding link may
// lose or repeat samples. Another candidate takes over only when the first one is gone, or lost
// while the other one is there. So a link that is lost alone keeps its mirror, and subscribers here
// notice nothing when it returns.
bool TopicMirror::refresh(const Now& now) {
  if (candidates_.empty()) return false;  // the mirror lingers
  bool taken_over = false;
  const auto present = std::find_if(candidates_.begin(), candidates_.end(),
                                    [](const MirrorCandidate& c) { return c.is_usable(); });
  if (!candidates_.front().is_usable() && present != candidates_.end()) {
    std::iter_swap(present, candidates_.begin());
    present->link->arrived.erase(key_.first);  // the new feeder brings the kept messages
    charge();
    taken_over = true;
  }
  follow_feeder();
  // The peer may offer a local publisher for a moment after its end: no mirror for it either.
  is_local_ = is_local_ || context_.graph.is_local(key_.second);
  // A publisher sends to all its subscribers, and nothing twice: another one is made.
  if (feeder() && misses_samples()) vanish();  // mutant: late_subscriber
  const bool exists = may_exist();
  if (exists && !id_ && feeder() && candidates_.front().link->open()) {
    const bool settled = has_settled(now);
    if (has_waited_for_name(now) && settled && may_be_made(now)) {
      taken_over = true;
      create(now);
    }
  }
  if (!exists) destroy();
  // Without a feeder another bridge may have the origin.
  if (!exists || (!id_ && !feeder())) give_up_claim();
  update_demand(now);
  return taken_over;
}

void TopicMirror::update(const Now& now, const PeerTopic* sends) {
  const bool lacks_samples = refresh(now);
  if (lacks_samples && candidates_.front().offered != sends) ask_for_last_samples(now);
}

bool TopicMirror::has_settled(const Now& now) {
  const bool claimed = claiming_.holds();
  const TimePoint settled =
      claiming_.want({*context_.graph_since + kTopicDiscovery,
                      context_.beside_bridges() ? kTopicSettle : Duration::zero()},
                     now);
  if (claimed != claiming_.holds()) context_.outputs.follow_up(FollowUp::kClaim);
  if (settled > now.steady) settles_ = timers().set(settled, this);
  return settled <= now.steady;
}

void TopicMirror::give_up_claim() {
  if (claiming_.holds()) context_.outputs.follow_up(FollowUp::kClaim);
  claiming_.give_up();
  settles_.cancel();
}

// A mirror that moves from our own node to the proxy node loses samples in between.
bool TopicMirror::has_waited_for_name(const Now& now) {
  if (!context_.graph_options.proxy_nodes || !origin_.node.empty()) return true;
  if (!naming_) naming_ = timers().set(now.steady + kNaming, this);
  return naming_.at() <= now.steady;
}

// Endpoints that come and go cost every process in the graph.
bool TopicMirror::may_be_made(const Now& now) {
  if (retries_ && retries_.at() > now.steady) return false;
  Link& link = *candidates_.front().link;
  // While changed rules are applied, one link's topic may have ended and the next one's not yet.
  if (!import_right(context_, link, InterfaceKind::kTopic, key_.first, action_type_)) return false;
  const auto answer = link.account->mirrors.ask(*this, now.steady);  // mutant: mirrors_pace
  if (answer == Appearing::Answer::kLate) link.mirrors.note_wait();
  return answer == Appearing::Answer::kNow;
}

bool TopicMirror::may_exist() const {
  if (!context_.graph_since || failed_ || is_local_) return false;  // mutant: loops
  if (context_.claims.taken(key_.second, claiming_.holds())) return false;
  // Both ends are in one graph. The peer's topics are here already, though our part of the
  // middleware may discover them later than the peer's.
  const Connection* const connection = candidates_.front().link->connection();
  return !connection || !context_.claims.is_here(connection->peer().side);
}

Payer TopicMirror::payer() const {
  return candidates_.empty() ? nullptr : candidates_.front().link->account->time;
}

void TopicMirror::create(const Now& now) {
  const Outputs::Paying paying(context_.outputs, payer());
  id_ = context_.outputs.new_id<MirrorId>();
  candidates_.front().declined = false;
  const auto published = candidates_.front().link->published.take(key_);
  last_number_ = published.number;
  reached_ = published.subscribers;
  fresh_ = 0;
  sample_bytes_ = 0;
  context_.mirrors.note_created(id_, *this);
  if (candidates_.front().link->arrived.contains(key_.first))
    pauses_ = timers().set(now.steady + kMatching, this);
  if (context_.options.matching > Duration::zero() || !first_.empty())
    first_.wait(now.steady + context_.options.matching);
  const auto& [topic, type] = key_.first;
  proxy_node_ = take_proxy_node(context_, *candidates_.front().link, origin_.node);
  Qos qos = qos_;
  qos.depth = depth();
  context_.outputs.push(CreateMirror{id_, topic, type, type_hash_, qos,
                                     proxy_node_ ? *proxy_node_ : "", any_definition_});
  context_.outputs.follow_up(FollowUp::kClaim);
  warn_incompatible(now);
}

// Subscribers of another publisher, or of another bridge's mirror, must not get messages that were
// kept for this one.
void TopicMirror::destroy() {
  if (id_ && may_resume(origin_.qos, qos_))
    for (const MirrorCandidate& candidate : candidates_) candidate.link->arrived.erase(key_.first);
  vanish();
}

void TopicMirror::vanish(bool exists) {
  drop_first();
  first_.end_wait();
  if (!id_) return;
  if (exists) context_.outputs.push(DestroyMirror{id_});
  context_.mirrors.note_destroyed(id_, exists);
  id_ = {};
  pauses_.cancel();
  kept_.release();
  proxy_node_.reset();
  unnamed_.cancel();
  context_.outputs.follow_up(FollowUp::kClaim);
}

void TopicMirror::drop_first() {
  if (!first_.empty()) {
    last_number_ = before_first_;
    fresh_ = 0;
  }
  first_.drop(feeder());
}

void TopicMirror::on_failed(const MirrorFailed& failed, const Now& now) {
  tell_failed(failed);
  failed_ = true;
  vanish(false);
  const bool passes = failed.code != "type_unknown" && failed.hash_here.empty();
  if (passes) retries_ = timers().set(now.steady + kRetry, this);
  const bool of_type = failed.code == "type_mismatch";
  update_demand(now);
  for (auto& [link, offered, declined, qos, refused] : candidates_) {
    if (!offered || (of_type && !is_of_its_type(*offered))) continue;
    declined = declined || of_type;
    if (!std::exchange(refused, true))
      link->decline(offered->number(), InterfaceKind::kTopic, key_.first,
                    {failed.reason, failed.code});
  }
  update(now);  // an offer with another definition may feed the mirror
}

void TopicMirror::try_again() {
  if (retries_) retries_ = timers().set(TimePoint{}, this);
}

void TopicMirror::on_time(const Now& now) {
  const auto is_due = [&](const Timer& timer) { return timer && timer.at() <= now.steady; };
  if (is_due(ends_)) {
    const auto needed = context_.wheels.needs(*this);  // another one may have halted it meanwhile
    if (!needed || *needed <= now.steady) return destroy();
    ends_ = timers().set(*needed, this);
    return;
  }
  first_.publish_due(context_.outputs, id_, feeder(), now);
  if (is_due(unnamed_)) warn_incompatible(now);
  if (is_due(retries_)) failed_ = false;
  if (!id_ && (is_due(retries_) || is_due(naming_) || is_due(settles_))) update(now);
  bool lapsed = false;
  for (Timer* const timer : {&pauses_, &expected_}) {
    if (!is_due(*timer)) continue;
    timer->cancel();
    lapsed = true;
  }
  if (lapsed) update(now);
}

bool TopicMirror::adopt(const PeerTopic& offered, const Now& now) {
  if (offered.treatment().allow_type_mismatch)
    find_candidate(candidates_, offered.link().id)->declined = false;
  const bool existed = bool(id_);
  const bool changed = feeder() == &offered && follow_feeder();
  if (changed || failed_) update(now);
  return changed && existed;
}

void TopicMirror::warn_incompatible(const Now& now) {
  const TopicState* topic = context_.graph.find(key_.first);
  if (!id_ || !topic || !context_.graph_options.qos_must_fit) return;
  // After the time for names, subscribers that still have none are logged without one.
  const bool patient = !unnamed_ || unnamed_.at() > now.steady;
  const auto found = incompatible_subscribers(*topic, qos_, origin_.node, patient);
  for (const auto& line : found.lines) log_once(LogLevel::kWarn, line);
  if (found.unnamed && !unnamed_) unnamed_ = timers().set(now.steady + kSubscriberNaming, this);
  if (!patient) unnamed_.cancel();
}

std::string TopicMirror::name(bool with_node) const {
  const auto& [topic, type] = key_.first;
  const std::string what = shown(InterfaceKind::kTopic, topic, type);
  return with_node && !origin_.node.empty() ? what + " of " + origin_.node : what;
}

void TopicMirror::log_once(LogLevel level, const std::string& text) const {
  if (!candidates_.empty())
    context_.outputs.log_once(candidates_.front().link->account->logged, level, text);
}

void TopicMirror::tell_failed(const MirrorFailed& failed) const {
  if (!failed.hash_here.empty()) return tell_difference(failed.hash_here, false);
  log_once(LogLevel::kError,
           "cannot mirror " + name(failed.code == "type_mismatch") + ": " + failed.reason);
}

void TopicMirror::tell_difference(const std::string& hash_here, bool used) const {
  if (candidates_.empty()) return;
  log_difference(context_.outputs, *candidates_.front().link,
                 {name(true), key_.first.second, hash_here, type_hash_, used});
}

// ---- demand

MirrorWish TopicMirror::wish(const Now& now) const {
  const auto lasts = [&](const Timer& timer) { return timer && timer.at() > now.steady; };
  const bool ready = feeder() && id_ && !lasts(pauses_);
  return {feeder(), ready, ready && lasts(expected_), kept_bytes() > 0};
}

void TopicMirror::pause(const Now& now) {
  const TimePoint until = now.steady + kPause;
  if (!id_ || (pauses_ && pauses_.at() >= until)) return;
  pauses_ = timers().set(until, this);
  wish_.change(wish(now));
}

void TopicMirror::expect_subscriber(const Now& now) {
  expected_ = timers().set(now.steady + kGoalDemand, this);
  update_demand(now);
}

// The feeding link's channel may be demanded for other origins already: then the peer does not send
// this origin's last samples unasked.
void TopicMirror::ask_for_last_samples(const Now& now) const {
  if (is_latched() && feeder() && feeder()->demanded()) feeder()->demand_again(now);
}

// ---- data

std::uint64_t TopicMirror::last_number_of(const PeerTopic& feeder) const {
  return id_ && this->feeder() == &feeder && is_transient_local(origin_.qos) ? last_number_ : 0;
}

std::optional<DropReason> TopicMirror::refusal(const Link& link) const {
  // The mirror may wait for its node's name, or because its identity makes too many mirrors.
  if (!id_ && (is_latched() || !may_exist())) return DropReason::kNoDemand;
  if (candidates_.front().link != &link) return DropReason::kDuplicate;  // another link feeds it
  return std::nullopt;
}

// The exporter sends a transient-local origin's last samples again after a reconnect and when
// demand returns, whatever the mirror's own QoS. A link that takes over as feeder may also be
// behind the first. The number is the origin's own, so it does not depend on the sample's path.
std::optional<DropReason> TopicMirror::publish(std::uint64_t number, const Payload& raw,
                                               TimePoint expires, const Now& now) {
  if (has_published(number)) return DropReason::kDuplicate;  // mutant: duplicate_samples
  if (keeps_samples() && raw.size() > sample_bytes_) {
    const std::uint32_t fitting = fitting_depth(raw.size());
    if (fitting == 0) return DropReason::kQueueBytes;
    if (fitting < depth()) {
      depth_max_ = fitting;
      destroy();
      update(now);
      // The sample comes again. Without a publisher (there were too many) it cannot go anywhere.
      if (is_latched() || !id_) return DropReason::kQueueBytes;
    }
    sample_bytes_ = raw.size();
    charge();
  }
  if (first_.empty()) before_first_ = last_number_;
  last_number_ = std::max(last_number_, number);
  // Samples that the middleware keeps for late subscribers need not wait or be displaced.
  const bool waits = !id_ || (first_.waits() && (!keeps_samples() || first_.fits(raw.size())));
  if (id_ && fresh_ < depth()) ++fresh_;
  if (waits && first_.keep(raw, expires, feeder())) return std::nullopt;
  if (!id_) return DropReason::kNoDemand;
  first_.publish(context_.outputs, id_, feeder(), now);
  context_.outputs.push(Publish{id_, held_if_large(raw)});
  return std::nullopt;
}

void TopicMirror::halt(const Payload& zero, const Now& now) {
  if (first_.empty()) before_first_ = last_number_;
  if ((!id_ || first_.waits()) && first_.keep(zero, TimePoint::max(), feeder())) return;
  if (!id_) return;
  first_.publish(context_.outputs, id_, feeder(), now);
  context_.outputs.push(Publish{id_, zero});
}

Payload TopicMirror::held_if_large(const Payload& raw) const {
  if (raw.size() <= kLargeSample || candidates_.empty()) return raw;
  struct Held {
    Payload raw;
    std::shared_ptr<Account> account;  // declared before the hold, so that it outlives it
    Budget::Hold bytes;
  };
  const auto& account = candidates_.front().link->account;
  auto held = std::make_shared<Held>(Held{raw, account, account->memory.hold(raw.size())});
  return Payload::wrap(std::move(held), raw.view());
}

// Kept bytes count four times in room(). So with a share of a quarter, the mirrors of a link leave
// at least as much to its messages as they hold themselves.
std::uint64_t TopicMirror::room(std::uint64_t share) const {
  const Budget& latched = candidates_.front().link->mirrors.latched();
  const std::uint64_t own = kept_bytes();
  const std::uint64_t others = latched.used() - std::min(latched.used(), own);
  const std::uint64_t all = context_.options.mirror_bytes_max;
  return std::min(all - std::min(others, all), latched.room() / share + own);
}

// A power of two: so a peer whose samples grow and grow makes us recreate the publisher only a few
// times. A single sample may take more of the remaining room than several.
std::uint32_t TopicMirror::fitting_depth(std::uint64_t sample_bytes) const {
  const std::uint64_t several = room(8) / sample_bytes;
  if (several >= depth()) return depth();
  if (several > 0) return static_cast<std::uint32_t>(std::bit_floor(several));
  return room(4) < sample_bytes ? 0 : 1;
}

void TopicMirror::charge() {
  kept_.release();
  first_.draw_from(candidates_.empty() ? nullptr : &candidates_.front().link->memory);
  if (!candidates_.empty()) kept_ = candidates_.front().link->mirrors.latched().hold(kept_bytes());
}

}  // namespace connect_bridge
