#include "core/mirrors/peer_topic.hpp"

#include <algorithm>
#include <utility>

#include "core/base/cdr.hpp"
#include "core/link/link_audit.hpp"
#include "core/media/columns.hpp"
#include "core/media/sample_codec.hpp"
#include "core/mirrors/link_topics.hpp"
#include "core/topics/sample_content.hpp"
#include "core/topics/topic_qos.hpp"
#include "core/video/picture.hpp"

namespace connect_bridge {
namespace {

// Limit of messages behind one that a worker has: one turn of the loop publishes all of them.
constexpr std::size_t kWaitingMax = 1024;
constexpr Duration kDemandAgain = std::chrono::seconds(1);
constexpr Duration kDecodingMax = std::chrono::milliseconds(500);

}  // namespace

PeerTopic::PeerTopic(LinkTopics& peer, TopicKey key, const ChannelOffer& offer, Decision decision)
    : peer_(peer),
      context_(peer.context()),
      link_(peer.link()),
      number_(offer.channel),
      key_(std::move(key)),
      type_hash_(offer.type_hash),
      action_type_(offer.action_type),
      decision_(std::move(decision)),
      decodes_{.vp8 = video::has_pictures(key_.second) && context_.options.pictures,
               .cloud = is_cloud(key_.second),
               .planes = has_planes(key_.second)},
      offers_resume_(offer.resume),
      held_(link_.memory, {context_.held, this}),
      unjudged_(link_.memory, {context_.held, this}),
      deltas_(peer.bases()) {
  const auto wire_name = link_.names.to_wire(key_.first);
  parameter_events_ = key_.second == kParameterEventType && wire_name &&
                      is_parameter_events(InterfaceKind::kTopic, *wire_name);
  command_ = steers();
  link_.take_offered(number_, *this);
  if (!offers_resume_) link_.arrived.erase(key_);
}

PeerTopic::~PeerTopic() {
  link_.let_go(number_);
  peer_.forget_name(key_);
}

// ---- origins

void PeerTopic::add_origin(const OriginOffer& origin, const Now& now) {
  if (!origin.origin) return;
  if (const auto known = origins_.find(origin.origin); known != origins_.end())
    return known->second->name_node(origin.node, now);
  if (withholds(origin) || left_out_.contains(origin.origin)) return;
  TopicMirror* mirror = context_.mirrors.open({key_, origin.gid}, link_);
  if (!mirror) {
    left_out_.add(origin, link_.memory);
    peer_.note_left_out(number_);
    context_.look_again(now);
    // Logged once for the identity: the names are the peer's, and may be thousands.
    if (link_.account->logged.first("no more mirrors"))
      context_.outputs.log(LogLevel::kWarn,
                           "no more mirrors for " + link_.label() + ", first on " + key_.first +
                               " (too many of this peer or of a topic, or what others leave)");
    return;
  }
  if (!mirror->add_candidate(*this, origin)) return;  // the peer offers one origin twice
  origins_[origin.origin] = mirror;
  if (command_) context_.wheels.on_offered(key_, now);
  volatile_ += !is_transient_local(origin.qos);
  mirror->update(now, this);
}

Result<Nothing> PeerTopic::on_origins(const OriginsChanged& change, const Now& now) {
  // Removals come first, so a peer can replace all of a channel's publishers in one message.
  for (const OriginId id : change.removed) {
    left_out_.remove(id);
    deltas_.forget(id);
    const auto origin = origins_.find(id);
    if (origin == origins_.end()) continue;
    hurry(DropReason::kUnknownOrigin, now, id);
    pictures_.erase(id);
    broken_.erase(id);
    context_.mirrors.remove_candidate(take_out(origin), link_.id, now);
    if (!link_.note_withdrawal(now))
      return Error{CloseCode::kTooLarge, "origins come and go too often"};
  }
  const auto fresh = std::count_if(change.added.begin(), change.added.end(), [&](const auto& o) {
    return !origins_.contains(o.origin) && !left_out_.contains(o.origin);
  });
  if (origins_.size() + left_out_.size() + static_cast<std::size_t>(fresh) > kChannelOriginsMax)
    return Error{CloseCode::kTooLarge, "more origins on a channel than this side accepts"};
  for (const auto& origin : change.added) add_origin(origin, now);
  if (!change.removed.empty()) update_demand(now);  // perhaps only the removed origin wanted data
  on_too_large(change.too_large, change.too_large_bytes);
  return Nothing{};
}

void PeerTopic::on_too_large(std::uint64_t messages, std::uint64_t bytes) {
  if (messages <= too_large_) return;
  dropped_.add(DropReason::kTooLarge, messages - std::exchange(too_large_, messages));
  if (link_.account->logged.first(key_.first + " has messages beyond our limit"))
    context_.outputs.log(LogLevel::kWarn, key_.first + ": " + link_.label() +
                                              " drops messages of " + std::to_string(bytes) +
                                              " bytes, which are larger than `max_message_size` "
                                              "here. A larger limit lets them come");
}

bool PeerTopic::recheck(const Now& now) {
  auto decision = import_right(context_, link_, InterfaceKind::kTopic, key_, action_type_);
  if (!decision) return false;
  decision_ = *std::move(decision);
  const bool steered = command_.has_value();
  command_ = steers();
  if (steered && !(command_ && treatment().wheel))
    context_.wheels.on_rule_without(context_, key_, link_, now);
  if (command_ && !steered) context_.wheels.on_offered(key_, now);
  const std::size_t before = origins_.size();
  for (auto it = origins_.begin(); it != origins_.end();) {
    const auto origin = it++;
    if (withholds(origin->second->origin()))
      context_.mirrors.remove_candidate(take_out(origin), link_.id, now);
  }
  if (origins_.size() < before) update_demand(now);
  return true;
}

void PeerTopic::renew(const Now& now) {
  bool renewed = false;
  for (const auto& [id, mirror] : origins_) renewed = mirror->adopt(*this, now) || renewed;
  if (renewed || (demanded_ && wants_lossy() != lossy_)) demand_again(now);  // mutant: lossy_live
}

// ---- the end

void PeerTopic::decline(const Now& now) {
  if (command_) context_.wheels.on_right_end(context_, key_, link_, now);
  if (std::exchange(demanded_, false)) peer_.change_demand(*this, false);
  const Ending why = no_longer_permitted();
  note_end(why);
  link_.decline(number_, InterfaceKind::kTopic, key_, why);
  leave_mirrors(now);
}

void PeerTopic::note_end(const Ending& why) const {
  note_import_end(context_, link_, InterfaceKind::kTopic, key_, decision_.rule, why);
}

void PeerTopic::on_withdraw(const Withdraw& why, const Now& now) {
  log_withdrawn(context_.outputs, link_, shown(InterfaceKind::kTopic, key_.first, key_.second),
                why);
  note_end({why.reason.empty() ? "the peer withdrew it" : why.reason, why.code});
  hurry(DropReason::kWithdrawn, now);  // a publisher may end right after its last message
  leave_mirrors(now);
  peer_.erase(number_);
}

void PeerTopic::leave_mirrors(const Now& now) {
  for (const auto& [id, mirror] : take_all())
    context_.mirrors.remove_candidate(*mirror, link_.id, now);
}

void PeerTopic::finish(const Now& now) {
  if (resume_) hurry(DropReason::kLinkLost, now);
  // Nobody knows the length of the break.
  for (const auto& [id, mirror] : origins_)
    if (mirror->has_first() && mirror->candidates().front().offered == this &&
        (link_.end.dies || !may_come_late()))
      mirror->drop_first();
}

void PeerTopic::hurry(DropReason otherwise, const Now& now, std::optional<OriginId> of) {
  const auto concerned = [&](const Waiting& waiting) {
    return !of || *of == waiting.message.subject.origin();
  };
  const bool first = !waiting_.empty() && concerned(waiting_.front());
  if (first) job_.cancel();
  for (auto& waiting : std::exchange(waiting_, {})) {
    if (!concerned(waiting)) {
      waiting_.push_back(std::move(waiting));
      continue;
    }
    const auto raw = is_vp8(waiting.message.codec) ? std::nullopt
                                                   : peer_.decompress_at_once(waiting.message, now);
    raw ? publish(waiting.message, *raw, now) : dropped_.add(otherwise);
  }
  if (first) advance(now);
  // The last message of a publisher counts for the rate limit, but cannot wait for it.
  while (const auto held = of ? held_.take(*of) : held_.take())
    peer_.may_publish_last(now) ? publish(held->head, held->raw, now, true)
                                : dropped_.add(DropReason::kRate);
}

void PeerTopic::lose(const Now& now) {
  // Without a known sequence the next demand would request all behind 0. The peer would then send
  // again the messages that it was to discard, if this connection loses the demand that declined
  // them.
  const bool is_known = last_sequence_ > 0 || !declined_kept_;
  if (resume_ && is_known && context_.graph.has_reliable_subscriber(key_))
    link_.arrived[key_] = {last_sequence_};
  for (const auto& [id, mirror] : take_all()) mirror->lose_topic(link_.id, now);
}

// ---- demand

void PeerTopic::update_demand(const Now& now) {
  const TopicState* topic = context_.graph.find(key_);
  const bool listened = topic && !topic->subscribers.empty();
  const bool on = wishes_.any(listened);
  ++context_.judged;
  if (std::exchange(demanded_, on) == on) return;
  pulse_.begin(now.steady);
  peer_.change_demand(*this, on);
  // Once: mirrors that were made again keep nothing.
  if (!on && !listened && std::exchange(may_keep_, false)) may_keep_ = !forget_kept(now);
}

// Not for an action: its goals have ids, so its old status misleads nobody, and its services follow
// it. Not beside another bridge: it could claim the mirror while we recreate it. Not if one
// publisher is volatile: then the exporter keeps no samples to send again.
bool PeerTopic::forget_kept(const Now& now) const {
  if (!all_come_again() || !action_type_.empty() || context_.beside_bridges()) return false;
  for (const auto& [id, mirror] : origins_) {
    if (mirror->candidates().front().offered != this || mirror->kept_bytes() == 0) continue;
    mirror->destroy();
    mirror->update(now);
  }
  return true;
}

// Messages of /parameter_events are permitted one by one, and the rules may have changed when the
// link returns.
bool PeerTopic::may_resume() const {
  return link_.life.keeps() && !parameter_events_ && may_come_late();
}

bool PeerTopic::wants_lossy() const {
  return (decodes_.cloud || decodes_.vp8) && treatment().lossy != Lossy::kNever &&
         treatment().resume != true;
}

ChannelDemand PeerTopic::begin_demand(std::uint16_t number) {
  demand_ = number;
  deltas_.clear();
  resume_ = may_resume();
  lossy_ = wants_lossy();
  ChannelDemand begun{.channel = number_,
                      .number = number,
                      .resume = resume_,
                      .live = drives(treatment(), key_),
                      .decodes = decodes_,
                      .lossy = lossy_};
  begun.decodes.vp8 = decodes_.vp8 && pictures_fit_;
  for (const auto& [id, mirror] : origins_)
    if (const std::uint64_t last = mirror->last_number_of(*this);
        last != 0 && begun.has.size() < kHasMax)
      begun.has.push_back({id, last});
  const auto arrived = link_.arrived.extract(key_);
  if (offers_resume_ && resume_ && arrived && context_.graph.has_reliable_subscriber(key_)) {
    begun.after = last_sequence_ = arrived.mapped().sequence;
    link_.resume_incoming(number_, last_sequence_);
  }
  if (std::exchange(offers_resume_, false)) declined_kept_ = !begun.after;
  return begun;
}

void PeerTopic::end_demand() {
  resume_ = false;
  job_.cancel();
  dropped_.add(DropReason::kNoDemand, waiting_.size());
  waiting_.clear();
  pictures_.clear();
  broken_.clear();
  while (held_.take() || unjudged_.take()) dropped_.add(DropReason::kNoDemand);
  deltas_.clear();
}

void PeerTopic::demand_again(const Now& now) {
  for (const auto& [id, mirror] : origins_) mirror->pause(now);
  update_demand(now);
}

// ---- messages

Result<Nothing> PeerTopic::on_message(InMessage message, const Now& now) {
  wire_bytes_ += message.body.size();
  last_sequence_ = message.sequence;
  if (!wants(message.demand)) {
    dropped_.add(DropReason::kNoDemand);
    return Nothing{};
  }
  // An origin that has found no place, or is gone, has no codec here.
  if (is_vp8(message.codec) && !origins_.contains(message.subject.origin())) {
    dropped_.add(DropReason::kUnknownOrigin);
    return Nothing{};
  }
  if (!message.kept) {
    drop(message, DropReason::kMemory, now);
    return Nothing{};
  }
  if (!may_answer(decodes_, message.codec))
    return malformed("a message has a codec that its demand does not name");
  if (const auto noted = note_form(message); !noted) return noted.error();
  const auto useful = resolve(message, now);
  if (!useful) return useful.error();
  if (useful.value() == Useful::kNo) return Nothing{};
  // No message overtakes those with a worker.
  if (waiting_.empty() && message.codec == Codec::kNone) {  // mutant: decompressed_in_order
    publish(message, message.body, now);
    return Nothing{};
  }
  if (waiting_.empty() && !is_vp8(message.codec) && !context_.jobs.is_large(message.raw_bytes)) {
    auto raw = media::decode_sample(message.body.view(), message.codec, message.raw_bytes);
    if (!raw) return raw.error();
    publish(message, Payload::adopt(std::move(raw).value()), now);
    return Nothing{};
  }
  const std::uint64_t cost = message.body.size() + sizeof(Waiting);
  if (waiting_.size() >= kWaitingMax ||
      peer_.decoding().used() + cost > context_.options.decoding_bytes_max) {
    drop(message, DropReason::kQueueBytes, now);
    return Nothing{};
  }
  if (cost > link_.memory.room()) {
    drop(message, DropReason::kMemory, now);
    return Nothing{};
  }
  if (is_vp8(message.codec)) {
    const auto facts = video::facts_of(message.body.view());
    if (!facts || !pictures_of(message).make_room(facts->decoder_bytes)) {
      pictures_fit_ = false;
      drop(message, DropReason::kMemory, now);
      return Nothing{};
    }
    // A worker that is too slow must not make pictures ever older.
    if (!waiting_.empty() && now.steady - waiting_.front().since > kDecodingMax) {
      drop(message, DropReason::kQueueTime, now);
      return Nothing{};
    }
  }
  message.body = out_of_packet(message.body);
  make_room(message);
  auto bytes = peer_.decoding().hold(cost);
  waiting_.push_back(
      {std::move(message), std::move(bytes), useful.value() == Useful::kYes, now.steady});
  if (!job_) start_job();
  return Nothing{};
}

bool PeerTopic::follows(const InMessage& message) {
  const OriginId origin = message.subject.origin();
  if (message.codec == Codec::kPictureBase) broken_.erase(origin);
  return message.codec != Codec::kPictureDelta ||
         (pictures_.contains(origin) && !broken_.contains(origin));
}

void PeerTopic::drop(const InMessage& message, DropReason reason, const Now& now) {
  dropped_.add(reason);
  if (!is_vp8(message.codec)) return;
  broken_.insert(message.subject.origin());  // mutant: broken_pictures
  if (demanded_again_at_ && now.steady - *demanded_again_at_ < kDemandAgain) return;
  demanded_again_at_ = now.steady;
  demand_again(now);
}

Result<Nothing> PeerTopic::note_form(const InMessage& message) {
  if (is_vp8(message.codec)) {
    const auto facts = video::facts_of(message.body.view());
    if (!facts || facts->raw_bytes != message.raw_bytes ||
        facts->base != (message.codec == Codec::kPictureBase) ||
        facts->jpeg == has_planes(key_.second))
      return malformed("the head of a picture is damaged");
    if (!lossy_)  // mutant: lossy_never_picture
      return malformed("a message is not exact, and its demand asks for exact ones");
    sent_as_ = {Codec::kPictureBase, 0, facts->quantiser, facts->half};
    if (link_.account->logged.first(key_.first + " arrives as video"))
      context_.outputs.log(LogLevel::kInfo,
                           key_.first + " arrives from " + link_.label() +
                               " as video, where the link would carry too few exact pictures; the "
                               "status says how good (`sent_as_quality`). `lossy: never` in its "
                               "rule forbids it");
    return Nothing{};
  }
  if (message.codec != Codec::kPlanes && message.codec != Codec::kCloud) {
    sent_as_ = {};
    return Nothing{};
  }
  const auto facts = media::facts_of(message.body.view());
  if (!facts) return malformed("the head of a picture or cloud is damaged");
  if (facts->step_um > 0 && !lossy_)  // mutant: lossy_never
    return malformed("a message is not exact, and its demand asks for exact ones");
  sent_as_ = {message.codec, facts->step_um};
  if (facts->step_um > 0 && link_.account->logged.first(key_.first + " arrives rounded"))
    context_.outputs.log(LogLevel::kInfo,
                         key_.first + " arrives from " + link_.label() +
                             " with rounded points, where the link would carry too few exact "
                             "clouds; the status says how much (`sent_as_step`). `lossy: never` in "
                             "its rule forbids it");
  return Nothing{};
}

// Every base is decoded, even of a dropped message: a later message may refer to it.
Result<PeerTopic::Useful> PeerTopic::resolve(InMessage& message, const Now& now) {
  const bool wanted = link_.may_inflate(message, now);
  if (is_vp8(message.codec)) {
    if (follows(message)) return wanted ? Useful::kYes : Useful::kForOthers;
    drop(message, DropReason::kMemory, now);
    return Useful::kNo;
  }
  if (!wanted) dropped_.add(DropReason::kRate);
  if (!makes_base(message.codec)) return wanted ? Useful::kYes : Useful::kNo;
  auto raw = deltas_.decode(message, wanted);
  if (!raw) return raw.error();
  if (!raw.value()) {
    if (wanted) dropped_.add(DropReason::kRate);
    return Useful::kNo;
  }
  message.codec = Codec::kNone;
  message.body = *std::move(raw).value();
  return Useful::kYes;
}

// A worker that is too slow must not make messages ever later. Beyond the depth of a volatile
// origin its new message replaces its oldest, if that is the next one after the worker's. Other
// origins lose nothing.
void PeerTopic::make_room(const InMessage& message) {
  const auto origin = origins_.find(message.subject.origin());
  if (origin == origins_.end()) return;
  const Qos& qos = origin->second->origin().qos;
  if (qos.durability != Durability::kVolatile || qos.history == History::kKeepAll) return;
  const std::size_t depth = std::max(qos.depth, context_.options.default_depth);
  if (waiting_.size() <= depth || waiting_[1].message.subject != message.subject) return;
  if (is_vp8(waiting_[1].message.codec)) return;  // mutant: spared_pictures
  waiting_.erase(std::next(waiting_.begin()));
  dropped_.add(DropReason::kQueueDepth);
}

Jobs::Pictures& PeerTopic::pictures_of(const InMessage& message) {
  return pictures_.try_emplace(message.subject.origin(), context_.jobs, link_.memory).first->second;
}

void PeerTopic::start_job() {
  const InMessage& message = waiting_.front().message;
  if (!is_vp8(message.codec)) {
    job_ = context_.jobs.decompress(*this, message.codec, message.raw_bytes, message.body,
                                    link_.turn());
    return;
  }
  job_ = pictures_of(message).decode(*this, message.raw_bytes, message.body, link_.turn());
}

void PeerTopic::on_job(std::optional<Payload> result, const Now& now) {
  job_.cancel();
  if (!result)
    return link_.fail(
        {CloseCode::kMalformed, "a compressed message does not decompress to its size"});
  const Waiting first = std::move(waiting_.front());
  waiting_.pop_front();
  first.published ? publish(first.message, *result, now) : dropped_.add(DropReason::kRate);
  advance(now);
}

void PeerTopic::advance(const Now& now) {
  while (!waiting_.empty()) {
    if (waiting_.front().message.codec != Codec::kNone) return start_job();
    const Waiting first = std::move(waiting_.front());
    waiting_.pop_front();
    publish(first.message, first.message.body, now);
  }
}

void PeerTopic::publish(const MessageHead& message, const Payload& raw, const Now& now,
                        bool was_held) {
  if (peer_.is_finished()) return dropped_.add(DropReason::kLinkLost);
  const auto origin = origins_.find(message.subject.origin());
  if (origin == origins_.end()) return dropped_.add(DropReason::kUnknownOrigin);
  TopicMirror& mirror = *origin->second;
  // The feeder's link is lost, and its topics have not all had their turn to end.
  if (!mirror.candidates().empty() && !mirror.candidates().front().link->open())
    mirror.update(now, this);
  if (const auto reason = mirror.refusal(link_)) return dropped_.add(*reason);
  if (!is_serialized(raw.view())) return dropped_.add(DropReason::kPublishFailed);
  if (parameter_events_ &&
      !is_event_of(mirror.origin().node, raw.view(), link_.names, context_.graph.find(key_)))
    return dropped_.add(DropReason::kNotPermitted);  // mutant: foreign_events
  if (command_ && !was_held)
    mirror.steered().seen.note({link_.connection() ? link_.connection()->id() : ConnectionId{},
                                message.demand, message.number, message.stamp},
                               now.steady, std::min(driving::kPressedAnew, treatment().halt_after));
  const auto command = command_ ? driving::read_command(*command_, raw.view()) : driving::Command{};
  if (waits_for_clock(message, raw, command.moves, now)) return;
  Duration age{0};
  if (!is_fresh(message, command.moves, mirror, age, now)) {
    if (command_) context_.wheels.on_old(mirror);  // mutant: stale_is_life
    return dropped_.add(DropReason::kMaxAge);
  }
  if (!was_held && !admits(message, raw, mirror, now)) return;
  std::optional<Payload> out;
  if (command_) {
    if (mirror.has_published(message.number)) return dropped_.add(DropReason::kDuplicate);
    out = steer(message, raw, command, age, mirror, now);
    if (!out) return dropped_.add(DropReason::kWheel);
  } else {
    out = with_names_here(mirror, raw);
  }
  const Duration limit = age_limit();
  const TimePoint expires =
      limit == kForever ? TimePoint::max() : now.steady + limit - std::max(age, Duration(0));
  if (const auto reason = mirror.publish(message.number, *out, expires, now))
    return dropped_.add(*reason);
  may_keep_ = true;
  pulse_.beat(now.steady);
  ++published_;
  bytes_ += raw.size();
}

// A command without a known age moves nothing. A neutral does not wait, and the command before it
// is over. A middleware without times of publication is known to have none.
bool PeerTopic::waits_for_clock(const MessageHead& message, const Payload& raw, bool moves,
                                const Now& now) {
  const Duration limit = age_limit();
  if (!command_ || limit == kForever || !is_plausible(message.stamp) || !link_.connection() ||
      link_.clock().known())
    return false;
  if (!moves) {  // mutant: stop_without_clock
    if (unjudged_.take(message.subject.origin())) dropped_.add(DropReason::kMaxAge);
    return false;
  }
  if (unjudged_.hold({message.subject.origin(), 0}, {message, out_of_packet(raw)}, raw.size(),
                     now.steady + limit))  // mutant: unknown_age
    dropped_.add(DropReason::kMaxAge);
  return true;
}

void PeerTopic::publish_unjudged(const Now& now) {
  for (std::size_t left = unjudged_.size(); left > 0; --left)
    if (const auto held = unjudged_.take()) publish(held->head, held->raw, now, true);
}

driving::PeerClock PeerTopic::peer_clock() const {
  if (!link_.connection() || !link_.clock().known()) return {};
  const ClockEstimate& clock = link_.clock();
  return {clock.offset(), clock.error_bound(), clock.total()};
}

bool PeerTopic::is_fresh(const MessageHead& message, bool moves, TopicMirror& mirror, Duration& age,
                         const Now& now) {
  const driving::PeerClock clock = peer_clock();
  if (clock.replies == 0 || !is_plausible(message.stamp)) return true;
  age = Duration(now.system - (message.stamp - clock.offset.count()));
  const Duration limit = age_limit();
  if (!command_ || limit == kForever) {
    if (age > limit) return false;  // mutant: max_age
  } else {
    TopicMirror::Steered& steered = mirror.steered();
    if (std::exchange(steered.judged_on, link_.connection()->id()) != link_.connection()->id())
      steered.ages = {};
    const auto verdict = steered.ages.judge(age, limit, clock);
    // A stop does not wait until the publisher's clock is understood.
    const bool is_old = verdict == driving::AgeJudge::Verdict::kOld && (moves || age > limit);
    if (is_old) return false;  // mutant: old_commands
    if (verdict == driving::AgeJudge::Verdict::kFreshAhead) warn_ahead(mirror, age);
    age = steered.ages.corrected(age);
  }
  latency_ms_ = static_cast<double>(age.count()) / 1e6;
  return true;
}

void PeerTopic::warn_ahead(const TopicMirror& mirror, Duration age) {
  ahead_ms_ = -static_cast<double>(age.count()) / 1e6;
  const std::string& node = mirror.origin().node;
  context_.outputs.log_once(
      link_.account->logged, LogLevel::kWarn,
      "the clock of the machine of " + (node.empty() ? "a publisher" : node) + " (" + key_.first +
          " of " + link_.label() + ") is " + std::to_string(-age / std::chrono::milliseconds(1)) +
          " ms ahead of its bridge's: the age of its commands counts from the youngest one. "
          "Synchronize both clocks");
}

std::optional<Payload> PeerTopic::steer(const MessageHead& message, const Payload& raw,
                                        const driving::Command& command, Duration age,
                                        TopicMirror& mirror, const Now& now) {
  const driving::PeerClock clock = peer_clock();
  std::optional<Payload> shifted;
  if (command.stamp.at != 0 && clock.replies > 0)
    shifted = driving::shifted(command, raw.view(), {clock, message.stamp}, now.system);
  if (shifted && context_.has_simulated_time()) shifted.reset();  // mutant: simulated_stamps
  const Payload& out = shifted ? *shifted : raw;
  const Treatment& rule = treatment();
  if (!rule.wheel) return out;
  const auto halt_after =
      rule.halt_after == kForever ? std::nullopt : std::optional(rule.halt_after);
  const SteeringCommand steering{*command_,     out, command.moves, age, {halt_after, rule.let_go},
                                 decision_.rule};
  if (!context_.wheels.judge(context_, mirror, link_, steering, now)) return std::nullopt;
  return out;
}

std::optional<driving::CommandType> PeerTopic::steers() const {
  if (!context_.options.at_robot || !drives(treatment(), key_)) return std::nullopt;
  return driving::command_type(key_.second);
}

void PeerTopic::tell_wheel(WheelState state) {
  if (std::exchange(sent_wheel_, state) != state) link_.send(Wheel{number_, state});
}

void PeerTopic::on_wheel_wanted(WheelWant want, const Now& now) {
  if (command_ && treatment().wheel)
    context_.wheels.on_wanted(context_, key_, link_, want, decision_.rule, now);
}

// An event that names the node as it is called here already stays as it is.
Payload PeerTopic::with_names_here(const TopicMirror& mirror, const Payload& raw) const {
  if (parameter_events_ && node_of_parameter_event(raw.view()) != mirror.origin().node) return raw;
  return with_local_names(key_.first, key_.second, raw.view(), link_.names).value_or(raw);
}

bool PeerTopic::admits(const MessageHead& message, const Payload& raw, const TopicMirror& mirror,
                       const Now& now) {
  RateLimit* rate = link_.rate_of(key_, mirror.origin().gid, treatment(), now);
  if (!rate) return true;
  const TopicState* topic = context_.graph.find(key_);
  const Stamp stamp = topic && topic->has_header ? header_stamp(raw.view()) : 0;
  const OriginId origin = message.subject.origin();
  if (const PacketFacts packet = packet_of(key_.second, raw.view());
      packet.part != VideoPart::kNone) {
    if (rate->admit(raw.size(), stamp, now.steady, packet.camera, packet.part)) return true;
    dropped_.add(DropReason::kRate);
    return false;
  }
  const std::uint64_t state = state_of(key_.second, raw.view()).value_or(0);
  const bool passes = rate->admit(raw.size(), stamp, now.steady, state);
  const std::uint64_t key = rate->key(state);
  const bool lost = passes ? held_.take({origin, key}).has_value()
                           : held_
                                 .hold({origin, key}, {message, out_of_packet(raw)}, raw.size(),
                                       rate->leaves_at(state))
                                 .has_value();
  if (lost) dropped_.add(DropReason::kRate);
  return passes;
}

void PeerTopic::publish_held(std::size_t& left, const Now& now) {
  const Outputs::Paying paying(context_.outputs, link_.account->time);
  while (unjudged_.take_due(now.steady, left)) dropped_.add(DropReason::kMaxAge);
  while (const auto held = held_.take_due(now.steady, left)) {
    const auto origin = origins_.find(held->head.subject.origin());
    const Gid gid = origin == origins_.end() ? Gid{} : origin->second->origin().gid;
    if (auto* rate = link_.rate_of(key_, gid, treatment(), now))
      rate->leave(held->raw.size(), now.steady,
                  state_of(key_.second, held->raw.view()).value_or(0));
    publish(held->head, held->raw, now, true);
  }
}

void PeerTopic::on_lost(std::uint64_t count, DropReason reason) {
  const auto counted = std::min(count, published_);  // the rest is older than this offer
  published_ -= counted;
  dropped_.add(reason, counted);
}

std::string PeerTopic::misfit() const {
  std::vector<Qos> published;
  for (const auto& [id, mirror] : origins_)
    if (mirror->id()) published.push_back(mirror->qos());
  const TopicState* topic = context_.graph.find(key_);
  return topic && context_.graph_options.qos_must_fit ? unmet_policy(*topic, published)
                                                      : std::string();
}

void PeerTopic::add_status(LinkStatus& status) const {
  TopicStatus s;
  s.topic = key_.first;
  s.type = key_.second;
  s.demanded = demanded_;
  s.origins = static_cast<std::uint32_t>(origins_.size());
  s.messages = published_;
  s.bytes = bytes_;
  s.wire_bytes = wire_bytes_;
  s.queued = waiting_.size() + held_.size() + unjudged_.size();
  s.latency_ms = latency_ms_;
  if (demanded_) {
    s.idle = pulse_.idle(status.at);
    s.usual_rate = pulse_.usual_rate();
  }
  s.dropped = dropped_;
  s.rule = decision_.rule;
  s.sent_as = sent_as_;
  s.misfit = misfit();
  if (command_ && treatment().wheel) s.wheel = sent_wheel_;
  if (const TopicState* here = context_.graph.find(key_); here && !here->publishers.empty())
    s.also_from = node_of(here->publishers.front());
  s.ahead_ms = ahead_ms_;
  status.topics.push_back(std::move(s));
}

void PeerTopic::leave_counts() const {
  if (published_ + dropped_.total() + waiting_.size() + held_.size() + unjudged_.size() == 0)
    return;
  LinkStatus last;
  add_status(last);
  link_.keep_counts(std::move(last.topics));
}

void PeerTopic::add_channel(std::vector<ChannelFacts>& channels) const {
  ChannelFacts facts{InterfaceKind::kTopic, false, key_.first, key_.second, decision_.rule};
  facts.misfit = misfit();
  channels.push_back(std::move(facts));
}

}  // namespace connect_bridge
