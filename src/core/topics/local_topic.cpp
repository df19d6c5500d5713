#include "core/topics/local_topic.hpp"

#include <algorithm>
#include <utility>

#include "core/policy/treatment.hpp"
#include "core/topics/sample_content.hpp"
#include "core/topics/topic_qos.hpp"

namespace connect_bridge {
namespace {

// The first sample of a publisher arrives within this time, unless the publisher had kept it.
constexpr Duration kFirstTime = std::chrono::seconds(2);

// Whether a local endpoint has the topic's name with another type.
bool has_other_type(const GraphView& graph, const TopicKey& topic) {
  const auto& topics = graph.topics();
  for (auto it = topics.lower_bound({topic.first, ""});
       it != topics.end() && it->first.first == topic.first; ++it)
    if (it->first.second != topic.second) return true;
  return false;
}

}  // namespace

LocalTopic::LocalTopic(ExportContext& context, TopicKey key)
    : context_(context),
      what_(
          std::make_shared<LocalInterface>(LocalInterface{InterfaceKind::kTopic, std::move(key)})),
      origins_({context.timers, this}),
      offers_(context, {context.timers, this}),
      backlogs_(context, what_, {context.timers, this}),
      parked_({context.timers, this}) {
  history_.draw_from(context.memory);
}

// ---- origins and links

void LocalTopic::on_graph(const Now& now) {
  const TopicState* state = context_.graph.find(key());
  // Also when its last publisher has just ended.
  const bool lacks = state ? state->lack.has_value() : lacks_type_;
  if (std::exchange(lacks_type_, lacks) != lacks) context_.news.insert(key());
  if (state) has_header_ = state->has_header;
  if (state) on_type_hash(*state, now);
  const bool is_new = origins_.empty();
  const auto changed = origins_.update(state, now);
  if (is_new && !origins_.empty()) context_.news.insert(key());
  if (!changed.empty()) {
    if (std::exchange(failed_, false)) offer_closed_again();
    if (offers_.size() > 0) context_.news.insert(key());  // each link is told in its turn
    warn_mixed();
    update_subscription(now);
  } else if (context_.listeners.listens(key())) {
    update_subscription(now);  // the name may have got another type
  }
  // The topic is offered to a listening peer first: then the links whose demand to wait for are
  // known.
  if (changed.empty() || parked_.empty() || !context_.listeners.listens(key())) return unpark(now);
  parked_.wait_until(now.steady);
}

// New publishers have another definition of the type than earlier ones, which the graph may still
// show: those of a killed process. The middleware decides which definition the graph reports.
// Without a publisher the definition of a subscriber counts.
void LocalTopic::on_type_hash(const TopicState& state, const Now& now) {
  if (state.type_hash.empty() || (state.publishers.empty() && !type_hash_.empty())) return;
  if (std::exchange(type_hash_, state.type_hash) == state.type_hash) return;
  for (auto it = offers_.begin(); it != offers_.end();) review((it++)->second.link(), now);
  context_.news.insert(key());
}

void LocalTopic::offer_closed_again() {
  if (!offers_.erase_closed()) return;
  context_.news.insert(key());
  context_.outputs.follow_up(FollowUp::kOffers);
}

void LocalTopic::remove_vanished(const Now& now) {
  const auto removed = origins_.remove_vanished(
      drained(), [this](OriginId origin) { return is_kept(origin); }, now);
  if (removed.empty()) return;
  for (const OriginId origin : removed) history_.remove(origin);
  for (auto& [link, offer] : offers_) {
    if (origins_.empty()) {
      // A topic that found no place on this link may now have this one's.
      if (!offer.link().may_offer()) context_.outputs.follow_up(FollowUp::kOffers);
      offer.withdraw({"it has no publisher any longer"});
    } else {
      offer.remove_origins(removed);
    }
  }
  // The topic lives on for its listeners: offers for its next publishers are decided again.
  if (origins_.empty()) offers_.clear();
  update_subscription(now);
}

void LocalTopic::on_listeners(const Now& now) {
  failed_ = failed_ && !origins_.empty();
  if (type_hash_.empty()) type_hash_ = context_.listeners.type_hash_of(key());
  update_subscription(now);
}

bool LocalTopic::is_over() const {
  return origins_.empty() && backlogs_.empty() && !context_.listeners.listens(key());
}

bool LocalTopic::drained() const {
  return parked_.empty() && offers_.drained();
}

bool LocalTopic::is_kept(OriginId origin) const {
  return backlogs_.hold(origin) || offers_.hold(origin);
}

std::optional<ChannelOffer> LocalTopic::offer_to(Link& link, const Now& now) {
  if (!is_due(link.id)) return std::nullopt;
  if (lacks_type_) {
    tell_lack(context_, link, *what_);
    return std::nullopt;
  }
  TopicOffer& offer = offers_.add(*this, link);
  auto opened = offer.open();
  if (!opened) tell_lack(context_, link, *what_);
  const bool resumes = backlogs_.take_over(offer, link.id, opened.has_value(), now);
  if (opened) opened->resume = resumes;
  return opened;
}

std::size_t LocalTopic::tell_origins(LinkId link) {
  const auto offer = offers_.find(link);
  return offer == offers_.end() ? 0 : offer->second.tell_origins();
}

void LocalTopic::review(const Link& link, const Now& now) {
  const auto it = offers_.find(link.id);
  if (it == offers_.end()) return;
  if (it->second.is_open()) {
    const auto why = it->second.review();
    if (!why) return;  // mutant: rules_withdraw
    backlogs_.end(link.id, DropReason::kWithdrawn, now);
    offers_.lose_under_way(it->second, DropReason::kWithdrawn);
    it->second.withdraw(*why);
  }
  if (offers_.erase(link.id)) update_subscription(now);
}

void LocalTopic::on_link_lost(LinkId link, const Now& now) {
  const auto offer = offers_.find(link);
  if (offer == offers_.end()) return;
  // Most links never had the topic open; then nothing changes.
  const bool was_open = offer->second.is_open();
  offers_.lose_under_way(offer->second, DropReason::kLinkLost);
  offer->second.drop_early(DropReason::kLinkLost);
  offer->second.leave_counts();
  offers_.erase(link);
  if (was_open) update_subscription(now);
}

void LocalTopic::on_demand(TopicOffer& offer, LinkId link, const ChannelDemand& demand,
                           const Now& now) {
  const bool subscribed = bool(subscription_);
  const auto all_early = offer.take_early();
  offers_.note(offer);
  // A failed subscription is tried again, for all links.
  if (offer.demanded() && std::exchange(failed_, false)) offer_closed_again();
  // Messages kept over a break come first. Without them, a worker's samples are of an ended demand.
  if (!backlogs_.go_on(offer, link, demand, now))
    offers_.lose_under_way(offer, DropReason::kNoDemand);
  update_subscription(now);
  // A new subscription brings the samples that its publishers keep, so only an old one needs this.
  if (offer.demanded() && subscribed) send_history(offer, now);                   // mutant: history
  const bool kept = subscription_qos_.durability == Durability::kTransientLocal;  // in the history
  for (const auto& sample : all_early)
    if ((!kept || offer.is_live()) && offer.admit(sample, TopicOffer::Age::kNew, now))
      offers_.send_to(offer, sample, now);
}

// The rule of a declined offer does not count any more.
void LocalTopic::on_decline(TopicOffer& offer, const Now& now) {
  offers_.note(offer);
  update_subscription(now);
}

void LocalTopic::on_time(std::size_t& held, const Now& now) {
  if (!parked_.empty()) unpark(now);
  offers_.on_time(held, now);
  const bool ended = backlogs_.end_overdue(now);
  if (offers_.drop_late(now) || ended) update_subscription(now);
  // Last step: a sample that still waits anywhere keeps its origin (drained).
  remove_vanished(now);
  if (late_ && late_.at() <= now.steady) update_subscription(now);
}

// ---- over connections

std::size_t LocalTopic::keep(LinkId link, const Now& now) {
  if (backlogs_.contains(link)) {
    backlogs_.renew(link, now);
    return 0;
  }
  const auto it = offers_.find(link);
  if (it == offers_.end()) return 0;
  if (!it->second.resumes() || !may_resume(subscription_qos_)) {
    it->second.drop_held(DropReason::kLinkLost);
    return 0;
  }
  auto on_its_way = offers_.take_under_way(link);
  it->second.take_all_held(on_its_way);
  return backlogs_.begin(it->second, link, on_its_way, now);
}

void LocalTopic::end_kept(LinkId link, const Now& now) {
  if (backlogs_.end(link, DropReason::kResumeBound, now)) update_subscription(now);
}

// ---- the subscription

Qos LocalTopic::wanted_qos() const {
  // A listener will demand the topic: another kind of subscription now would lose a first message.
  // Listeners that declined the topic, or whose time is over, do not count.
  QosOverride weakest = context_.listeners.rules_of(key(), [this](LinkId link) {
    const auto offer = offers_.find(link);
    return offer == offers_.end() || (offer->second.is_awaited() && !backlogs_.contains(link) &&
                                      !offer->second.is_declined());
  });
  if (offers_.want_live(key()) || backlogs_.want_volatile())
    weakest.durability = Durability::kVolatile;
  return qos_for(origins_, offers_, weakest, context_.options);
}

std::uint32_t LocalTopic::history_depth() const {
  std::uint32_t depth = 0;
  for (const auto& [gid, origin] : origins_) depth = std::max(depth, origin.qos.depth);
  if (depth == 0) depth = context_.options.latched_depth;
  for (const auto& [link, offer] : offers_)
    depth = std::max(depth, offer.treatment().qos.depth.value_or(0));
  return depth;
}

bool LocalTopic::is_wanted() const {
  if (context_.listeners.listens(key()) && !context_.graph.lacks_type_of(key()))
    return !origins_.empty() ||
           (context_.names.are_free(key().first, *this) && !has_other_type(context_.graph, key()));
  return !origins_.empty() && (context_.held.contains(key().first) || offers_.demanded() ||
                               (!backlogs_.empty() && may_resume(wanted_qos())));
}

void LocalTopic::update_subscription(const Now& now) {
  late_.cancel();
  if (!is_wanted()) return unsubscribe();
  if (failed_) return;
  const Qos qos = wanted_qos();
  history_.limit(history_depth(), context_.options.history_bytes_max);
  if (subscription_ && serves(subscription_qos_, qos) && is_hash_of(subscription_hash_, type_hash_))
    return take_name();
  // The present subscription serves until another one may be made.
  if (context_.reviewing)  // mutant: reviewed_links
    return static_cast<void>(context_.postponed.insert(key()));
  if (const TimePoint turn = turn_.take(context_.subscriptions, now.steady); turn > now.steady) {
    late_ = context_.timers.set(turn, this);
    return;
  }
  end_subscription();
  take_name();
  subscription_ = context_.outputs.new_id<SubscriptionId>();
  subscription_qos_ = qos;
  offers_.on_subscribed(qos);
  subscribed_at_ = now.system;
  subscription_hash_ = type_hash_;
  if (qos.durability == Durability::kVolatile) history_.clear();  // samples would become stale
  context_.by_subscription[subscription_] = this;
  context_.outputs.push(
      CreateSubscription{subscription_, key().first, key().second, type_hash_, qos});
}

void LocalTopic::take_name() {
  LocalTopic* other = context_.names.take(key().first, *this, origins_.empty());
  if (other) other->unsubscribe();
}

void LocalTopic::end_subscription() {
  if (!subscription_) return;
  context_.outputs.push(DestroySubscription{subscription_});
  forget_subscription();
}

void LocalTopic::forget_subscription() {
  context_.by_subscription.erase(subscription_);
  subscription_ = {};
  context_.names.leave(key().first, *this);
}

void LocalTopic::unsubscribe() {
  end_subscription();
  history_.clear();
  origins_.forget_samples();
  offers_.drop_under_way();
  parked_.clear();
}

void LocalTopic::on_subscription_failed(const std::string& code, const std::string& reason) {
  const std::string what = shown(InterfaceKind::kTopic, key().first, key().second);
  LoggedOnce& logged =
      origins_.empty() ? context_.listeners.logged_of(key()) : context_.outputs.logged();
  context_.outputs.log_once(logged, LogLevel::kError, "cannot export " + what + ": " + reason);
  forget_subscription();
  unsubscribe();
  failed_ = true;
  for (auto& [link, offer] : offers_) offer.withdraw({reason, code});
}

void LocalTopic::warn_mixed() {
  const auto volatiles = std::count_if(origins_.begin(), origins_.end(), [](const auto& entry) {
    return entry.second.qos.durability == Durability::kVolatile;
  });
  if (volatiles == 0 || volatiles == static_cast<std::ptrdiff_t>(origins_.size())) return;
  log_once(
      " has transient-local and volatile publishers: it is subscribed as volatile, so samples from "
      "before the subscription are not forwarded");
}

void LocalTopic::log_once(const std::string& what) {
  context_.outputs.log_once(LogLevel::kWarn, key().first + what);
}

// ---- samples

void LocalTopic::on_taken(MessageTaken taken, const Now& now) {
  if (taken.stamp == 0) taken.stamp = now.system;
  Origin* origin = origins_.find(taken.origin, subscription_qos_.durability);
  if (origin && !parked_.empty()) unpark(now);  // parked samples are older
  if (origin) return forward(*origin, std::move(taken), now.steady, now);
  if (!context_.is_of_bridge(taken.origin)) park(std::move(taken), now);
}

void LocalTopic::park(MessageTaken taken, const Now& now) {
  const bool asked = parked_.has(taken.origin);
  if (!parked_.add(std::move(taken), context_.parked, now))
    return offers_.drop(DropReason::kUnknownOrigin, 1);
  if (!asked) context_.outputs.push(RefreshGraph{key().first});
}

void LocalTopic::unpark(const Now& now) {
  parked_.review(
      now, [&](const Gid& gid) { return origins_.find(gid, subscription_qos_.durability); },
      [&](Origin& origin, MessageTaken taken, TimePoint at) {
        forward(origin, std::move(taken), at, now);
      },
      [&](const MessageTaken& taken) {
        if (!context_.is_of_bridge(taken.origin)) offers_.drop(DropReason::kUnknownOrigin, 1);
      });
}

// The history keeps the last samples of transient-local publishers, for links that demand the topic
// when it is subscribed already. A subscription that is made again (changed QoS) gets the
// publishers' kept samples again. Their numbers show that they were forwarded; their stamps, if the
// middleware does not count. A clock that is set back then suppresses samples for as long.
void LocalTopic::forward(Origin& origin, MessageTaken taken, TimePoint at, const Now& now) {
  loss_.took();
  auto age = TopicOffer::Age::kNew;
  const std::uint64_t order = taken.number != 0 ? taken.number : ++origin.taken;
  if (origin.qos.durability == Durability::kTransientLocal) origins_.number(taken);
  if (subscription_qos_.durability == Durability::kTransientLocal) {
    if (!Origins::is_new(origin, taken)) return offers_.drop(DropReason::kDuplicate, 1);
    history_.add({origin.id, taken.stamp, taken.number, taken.payload});
    // The first sample of a later publisher nearly counts as kept, too: it may be the only one. If
    // it comes much later than it was published, the publisher had kept it.
    const bool is_older = taken.stamp < subscribed_at_;
    const bool is_new = !is_older && taken.stamp > now.system - kFirstTime.count();
    if ((is_older || origin.kept == 0) && Origins::was_kept(origin, history_depth()))
      age = is_new ? TopicOffer::Age::kFirst : TopicOffer::Age::kKept;
  }
  OutSample sample{origin.id, taken.stamp, taken.number, std::move(taken.payload), {}};
  sample.order = order;
  read(sample, at);
  // A newer sample of one state may pass an older one of another: their order is not that of the
  // numbers, by which the importer would drop the second.
  if (origin.qos.durability == Durability::kVolatile && sample.state.value_or(0) != 0)
    sample.number = 0;  // mutant: numbered_states
  if (has_header_) sample.node = company_node(origin.node);
  const bool promised =
      origin.qos.reliability == Reliability::kReliable;  // mutant: best_effort_kept
  sample.reliable = promised && may_resume(subscription_qos_);
  // A kept sample reaches those who want it with the history, and is not new to the others.
  if (age != TopicOffer::Age::kKept) keep_early(sample, now);
  if (sample.reliable) {
    backlogs_.add(sample, now);
  } else if (promised) {
    backlogs_.miss();
  }
  offers_.send(sample, age, now);
}

void LocalTopic::offer_at_once(Link& link, const Now& now) {
  if (!is_due(link.id) || !link.open() || !link.accepts || !link.may_offer()) return;
  if (auto opened = offer_to(link, now)) send_offers(link, {*std::move(opened)}, false);
}

void LocalTopic::keep_early(const OutSample& sample, const Now& now) {
  // The backlog of a lost link has these samples, too.
  std::vector<TopicOffer*> awaited;
  for (const LinkId link : context_.listeners.links_of(key())) {
    offer_at_once(context_.listeners.link(link), now);  // mutant: early_before_its_turn
    const auto offer = offers_.find(link);
    if (offer != offers_.end() && offer->second.is_awaited() && !backlogs_.contains(link))
      awaited.push_back(&offer->second);
  }
  offers_.keep_early(awaited, sample, now);
}

void LocalTopic::send_history(TopicOffer& offer, const Now& now) {
  for (const auto& [origin, stamp, number, raw] : history_.samples()) {
    OutSample sample{origin, stamp, number, raw, {}};
    read(sample, now.steady);
    if (offer.admit(sample, TopicOffer::Age::kKept, now)) offers_.send_to(offer, sample, now);
  }
}

void LocalTopic::read(OutSample& sample, TimePoint taken) const {
  sample.taken = taken;
  sample.state = state_of(key().second, sample.raw.view());
  if (has_header_) sample.header = header_stamp(sample.raw.view());
  const PacketFacts packet = packet_of(key().second, sample.raw.view());
  sample.video = packet.part;
  sample.camera = packet.camera;
}

void LocalTopic::on_lost(const MessagesLost& lost, const Now& now) {
  if (!lost.too_large) loss_.lost(lost.count, now.steady);
  offers_.drop(lost.too_large ? DropReason::kTooLarge : DropReason::kLostHere, lost.count);
  if (lost.too_large) log_once(": messages larger than max_message_size are dropped");
}

// ---- status

void LocalTopic::add_steered(std::vector<TopicOffer*>& offers) {
  for (auto& [link, offer] : offers_)
    if (offer.steers()) offers.push_back(&offer);
}

void LocalTopic::add_status(LinkId link, LinkStatus& status) const {
  if (const auto offer = offers_.find(link); offer != offers_.end())
    offer->second.add_status(status);
}

void LocalTopic::add_channels(LinkId link, std::vector<ChannelFacts>& channels) const {
  if (const auto offer = offers_.find(link); offer != offers_.end())
    offer->second.add_channel(channels);
}

std::uint64_t LocalTopic::memory_bytes() const {
  return history_.bytes() + offers_.bytes();
}

}  // namespace connect_bridge
