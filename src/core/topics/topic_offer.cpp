#include "core/topics/topic_offer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/driving/command.hpp"
#include "core/media/columns.hpp"
#include "core/topics/local_topic.hpp"
#include "core/topics/sample_content.hpp"
#include "core/topics/topic_qos.hpp"
#include "core/video/picture.hpp"

namespace connect_bridge {
namespace {

// A message that takes at least this and some round trips shows the rate of its channel before it
// has left: slow start is over. After quick messages the path may only stand still for a moment.
constexpr Duration kTellingTime = std::chrono::milliseconds(300);
constexpr int kTellingRounds = 4;
// A path that carries far too little shows it sooner.
constexpr Duration kNearTime = std::chrono::milliseconds(150);
constexpr int kNearRounds = 2;
constexpr Duration kNearQueue = std::chrono::milliseconds(50);
constexpr std::string_view kFewPictures = "the link would carry too few exact pictures";
constexpr std::string_view kThinned = "the grid of the rule leaves out points";
constexpr std::string_view kThinnedAndRounded =
    "the link would carry too few exact ones, and the grid of the rule leaves out points";
constexpr Duration kOverloadTold = std::chrono::seconds(15);
constexpr Duration kTooLargePause = std::chrono::seconds(10);  // docs/protocol.md, "origins"

}  // namespace

TopicOffer::TopicOffer(ExportContext& context, LocalTopic& topic, Link& link)
    : context_(context),
      topic_(topic),
      link_(link),
      offer_(context, link, topic.what(), LinkOffer::Terms::kFixed),
      parameter_events_(are_parameter_events(link, *topic.what())),
      pictures_(*this, context, {context.timers, &topic}),
      early_({context.timers, &topic}),
      held_(link.memory, {context.timers, &topic}) {}

// ---- rights and options

bool TopicOffer::is_withheld(const Origin& origin) const {
  return parameter_events_ && !may_have_events(context_, link_, origin.node);
}

// An event may name any node, and not every middleware identifies the publisher.
bool TopicOffer::permits(const Payload& sample) const {
  if (!parameter_events_) return true;
  const auto node = node_of_parameter_event(sample.view());
  return node && may_have_events(context_, link_, *node);
}

bool TopicOffer::is_there(const OutSample& sample) const {
  const auto& has = demand_.has;
  return sample.number != 0 && std::any_of(has.begin(), has.end(), [&](const HeldSamples& held) {
           return held.origin == sample.subject.origin() && sample.number <= held.number;
         });
}

std::set<OriginId> TopicOffer::withheld() const {
  std::set<OriginId> result;
  for (const auto& [gid, origin] : topic_.origins())
    if (is_withheld(origin)) result.insert(origin.id);
  return result;
}

std::optional<Ending> TopicOffer::review() {
  const Treatment before = treatment();
  if (auto why = offer_.review(demanded())) return why;
  if (treatment() != before) follow(before);
  if (is_open()) tell_origins();  // those not told yet are no difference
  const bool same = withheld() == withheld_ && is_hash_of(type_hash_, topic_.type_hash());
  return same ? std::nullopt : std::optional(LinkOffer::offered_again());
}

void TopicOffer::follow(const Treatment& before) {
  const Treatment& after = treatment();
  if (after.max_rate != before.max_rate ||
      after.bytes_per_second_max != before.bytes_per_second_max)
    follow_rates();
  resume_ = demand_.resume && may_resume();
  configure_queue();
}

// Samples that the rates before have held leave at once, before newer ones.
void TopicOffer::follow_rates() {
  rates_ = RateLimits(treatment().max_rate, treatment().bytes_per_second_max);
  std::vector<OutSample> held;
  take_all_held(held);
  for (OutSample& sample : held) {
    const HeldBack<OutSample, LocalTopic*>::Key key{sample.subject.origin(),
                                                    sample.state.value_or(0)};
    const std::size_t bytes = sample.raw.size();
    if (const auto lost = held_.hold(key, std::move(sample), bytes, TimePoint{}))
      lose(*lost, DropReason::kRate);
  }
}

std::optional<ChannelOffer> TopicOffer::open() {
  auto offer = offer_.open(*this);
  if (!offer) return std::nullopt;
  withheld_ = withheld();
  note_told();
  wheel_.reset();
  too_large_ = 0;
  too_large_sent_.reset();
  rates_ = RateLimits(treatment().max_rate, treatment().bytes_per_second_max);
  configure_queue();
  offer->type_hash = type_hash_ = topic_.type_hash();
  offer->priority = priority_of(topic_.key(), treatment());
  offer->newest_only = is_clock(topic_.key());
  for (const auto& [gid, origin] : topic_.origins())
    if (!withheld_.contains(origin.id)) offer->origins.push_back(offer_of(gid, origin));
  return offer;
}

// A node outside our prefix has only its own name on the wire.
OriginOffer TopicOffer::offer_of(const Gid& gid, const Origin& origin) const {
  return {origin.id, gid, link_.names.wire_name(origin.node),
          qos_to_offer(origin.qos, treatment().qos)};
}

// Depth, bytes and lifespan follow the present publishers. Messages that wait already stay
// (ChannelQueue::configure).
void TopicOffer::configure_queue() {
  keep_ = keep_of(treatment(), topic_.key().second,
                  traits_of(topic_.origins(), topic_.has_header(), treatment()));
  company_ = company_of(topic_.key().first, topic_.key().second, treatment());
  namespace_ = company_namespace(topic_.key().first, company_);
  if (link_.connection())
    queue_ = &link_.sending().add_channel(
        number(), queue_of(topic_.key(), topic_.origins(), topic_.history_depth(), treatment(),
                           keep_.keep, context_.options));
}

// ---- changes

void TopicOffer::withdraw(const Ending& why) {
  pictures_.clear(DropReason::kWithdrawn);
  drop_held(DropReason::kWithdrawn);
  drop_early(DropReason::kWithdrawn);
  leave_counts(DropReason::kWithdrawn);
  offer_.close(why);
  queue_ = nullptr;
  demand_ = {};
}

void TopicOffer::note_told() {
  change_told_ = topic_.origins().last_change();
  newest_told_ = topic_.origins().newest();
}

std::size_t TopicOffer::tell_origins() {
  if (!is_open() || change_told_ == topic_.origins().last_change()) return 0;
  const auto changed = topic_.origins().changed_since(change_told_);
  note_told();
  OriginsChanged change{number(), {}, {}};
  for (const Gid& gid : changed) {
    const Origin& origin = topic_.origins().at(gid);
    if (is_withheld(origin)) {
      withheld_.insert(origin.id);
    } else {
      withheld_.erase(origin.id);
      change.added.push_back(offer_of(gid, origin));
    }
  }
  if (!change.added.empty()) send_change(change);
  configure_queue();  // depth and lifespan were those of the origins known before
  return changed.size();
}

// Messages of a new origin must not come before it. Those of one that ends, and may come again,
// must not refer to a base that the peer has forgotten.
void TopicOffer::send_change(const OriginsChanged& change) {
  link_.send(change);
  if (link_.connection()) link_.sending().follow_texts(number());  // mutant: before_its_origin
}

void TopicOffer::remove_origins(const std::vector<OriginId>& removed) {
  if (!is_open()) return;
  OriginsChanged change{number(), {}, {}};
  for (const OriginId origin : removed) {
    if (!is_told(origin)) continue;  // mutant: removed_untold
    change.removed.push_back(origin);
    withheld_.erase(origin);
    rates_.forget(origin);
    pictures_.end(origin);
    if (queue_) queue_->forget_base(origin);
  }
  if (!change.removed.empty()) send_change(change);
  configure_queue();
}

void TopicOffer::on_demand(const ChannelDemand& demand, const Now& now) {
  // Another number for a demanded channel changes nothing (docs/protocol.md, "demand"): a peer that
  // repeats its demand cannot make this side begin again.
  if (demanded() == (demand.number != 0)) return;
  demand_ = demand.number != 0 ? demand : ChannelDemand{};  // mutant: demand_ends
  resume_ = demand.resume && may_resume();
  demanded_at_ = now.system;
  pulse_.begin(now.steady);
  if (demanded()) offer_.on_taken();
  offer_.note(demanded() ? AuditEvent::kDemanded : AuditEvent::kDemandEnded);
  // The open message is aborted and waiting ones are dropped before the topic learns of its end.
  // The next demand begins with the last samples, and older ones must not come behind them
  // (docs/protocol.md section 8, rule 5).
  if (!demanded()) {
    link_.sending().clear_channel(number());
    pictures_.clear(DropReason::kNoDemand);
    drop_held(DropReason::kNoDemand);
  }
  // Origins of the offer may be gone by now; the numbers rise all the same.
  if (demanded() && demand.after)
    link_.sending().go_on(number(), {{}, *demand.after}, now, now.steady);
  topic_.on_demand(*this, link_.id, demand, now);
}

void TopicOffer::on_decline(const Decline& decline, const Now& now) {
  offer_.on_decline(decline, now);
  drop_early(DropReason::kNoDemand);
  topic_.on_decline(*this, now);
}

// ---- over connections

// The messages of /parameter_events are permitted one by one, and the rules may have changed when
// the link returns.
bool TopicOffer::may_resume() const {
  const auto& [name, type] = topic_.key();
  if (!treatment().resume && !context_.options.resumes_exported) return false;
  return link_.life.keeps() && !parameter_events_ &&
         treatment().qos.reliability != Reliability::kBestEffort &&
         connect_bridge::resumes(treatment(), name, type);
}

Backlog::Options TopicOffer::backlog_options(std::uint32_t last_sequence) const {
  Backlog::Options options;
  options.treatment = treatment();
  options.type_hash = type_hash_;
  options.rates = rates_;
  options.keep = keep_.keep;
  options.message_bytes_max = link_.peer_message_bytes_max();
  options.last_sequence = last_sequence;
  return options;
}

// Treatment (may_follow) and definition must be the same. Rules and rates of the former offer
// admitted the kept messages, and the importer knows their bytes by the former type.
bool TopicOffer::may_take_place_of(const Backlog& backlog) const {
  return is_open() && may_resume() && may_follow(backlog.treatment(), treatment()) &&
         is_hash_of(backlog.type_hash(), type_hash_);
}

void TopicOffer::go_on(Outbox::Unarrived kept, const Now& now) {
  tell_origins();  // some may have come since the offer
  // The new connection may have another limit of the peer.
  const auto too_large = std::erase_if(kept.messages, [&](const OutMessage& message) {
    return message.raw_bytes > link_.peer_message_bytes_max();
  });
  drop(DropReason::kTooLarge, too_large);
  // The peer may have been started again meanwhile, as a version that decodes less.
  const auto unknown =
      std::erase_if(kept.messages, [&](const OutMessage& message) { return !is_answer(message); });
  drop(DropReason::kLinkLost, unknown);
  // These messages answer the new demand: under the old number the peer would drop them.
  for (auto& message : kept.messages) message.demand = demand_.number;
  link_.sending().go_on(number(), std::move(kept), now, link_.life.kept_until(now));
}

bool TopicOffer::is_answer(const OutMessage& message) const {
  if (!may_answer(demand_.decodes, message.codec)) return false;
  if (message.codec != Codec::kCloud || demand_.lossy) return true;
  // A thinned cloud does not show what it lacks. The kept messages have the rule of now.
  if (rule_may_lose() && treatment().grid > 0) return false;
  const auto facts = media::facts_of(message.body.view());
  return facts && facts->step_um == 0;
}

bool TopicOffer::is_latched() const {
  const auto& origins = topic_.origins();
  return std::any_of(origins.begin(), origins.end(),
                     [](const auto& entry) { return is_transient_local(entry.second.qos); });
}

void TopicOffer::on_wheel(WheelState state, const Now&) {
  if (std::exchange(wheel_, state) != state) context_.outputs.follow_up(FollowUp::kWheels);
}

bool TopicOffer::steers() const {
  return is_open() && link_.open() && demanded() && treatment().drives != false &&
         driving::command_type(type());
}

const std::string& TopicOffer::name() const {
  return topic_.key().first;
}

const std::string& TopicOffer::type() const {
  return topic_.key().second;
}

bool TopicOffer::is_live() const {
  return (demanded() && demand_.live) || drives(treatment(), topic_.key());
}

bool TopicOffer::holds(OriginId origin) const {
  return pictures_.holds(origin) || (queue_ && queue_->holds(origin));
}

// ---- pictures

TopicOffer::Rate TopicOffer::channel_rate(const Now& now) const {
  if (!queue_) return {};
  const Overload& overload = queue_->overload();
  if (overload.rate() > 0) return {overload.rate(), true};
  const Duration round = link_.clock().round_trip();
  const Duration telling =
      overload.is_quick() ? Overload::kSurelyTelling : kTellingTime + kTellingRounds * round;
  const auto progress = queue_->progress(now.steady);
  if (!progress) return {path_rate(), false};
  const double time = std::chrono::duration<double>(progress->time).count();
  const double rate = static_cast<double>(progress->bytes) / time;
  if (progress->time >= telling) return {rate, true};
  const bool is_near = !overload.is_quick() && link_.open() &&
                       link_.outbox().pacer().queue() > std::max(round, kNearQueue) &&
                       progress->time >= kNearTime + kNearRounds * round;
  return {is_near ? std::max(rate, path_rate()) : path_rate(), false, is_near};
}

bool TopicOffer::has_camera_info(const OutSample& sample) const {
  const std::string& image = topic_.key().first;
  std::string base = image.substr(0, image.rfind('/'));
  // A form of image_transport (/camera/image_raw/compressed) is one level deeper.
  if (company_namespace(image, Company::kLarge) != company_namespace(image, Company::kFollows))
    base.resize(base.rfind('/'));
  const TopicState* const infos =
      context_.graph.find({base + "/camera_info", "sensor_msgs/msg/CameraInfo"});
  return infos && sample.node != 0 &&
         std::any_of(infos->publishers.begin(), infos->publishers.end(),
                     [&](const Endpoint& publisher) {
                       return company_node(node_of(publisher)) == sample.node;
                     });
}

bool TopicOffer::may_be_picture(const OutSample& sample) const {
  const bool may = context_.options.pictures && demand_.decodes.vp8 && may_lose() &&
                   !is_latched() && pictures_.takes(sample.subject.origin()) &&
                   (treatment().lossy == Lossy::kAuto || has_camera_info(sample));
  if (!may) return false;
  const std::uint64_t bytes = video::picture_bytes(type(), sample.raw.view());
  return bytes > 0 && bytes <= link_.peer_message_bytes_max();  // more than those of a JPEG
}

bool TopicOffer::has_one_origin() const {
  return topic_.origins().size() == 1;
}

// The rest of an exact sample that is partly sent would take longer than many pictures. Samples of
// other publishers may be exact from now on, too, and stay.
void TopicOffer::begin_pictures() {
  if (!has_one_origin()) return;
  link_.sending().clear_channel(number(), DropReason::kNewerAvailable);
}

// ---- samples

bool TopicOffer::admit(const OutSample& sample, Age age, const Now& now) {
  const OriginId origin = sample.subject.origin();
  const std::size_t bytes = sample.raw.size();
  // Not counted as dropped: the peer did not want it.
  if (!demanded()) return false;
  if (age == Age::kNew) pulse_.beat(now.steady);
  // A sample comes behind its origin, which may not have had its turn. An event of a node is
  // withheld until the node's name is known.
  if (parameter_events_ || !is_told(origin)) tell_origins();  // mutant: origin_before_its_turn
  const bool is_old = age == Age::kKept || sample.taken < link_.life.opened_at() ||
                      (age == Age::kFirst && sample.stamp < demanded_at_);
  if (is_old && is_live()) return false;  // mutant: yesterdays_command
  if (is_there(sample)) return false;     // mutant: sent_again
  if (withheld_.contains(origin)) return false;
  if (!permits(sample.raw)) {
    drop(DropReason::kNotPermitted);
    return false;
  }
  if (bytes > link_.peer_message_bytes_max()) {
    // Logged once, as the peer can have the topic offered again as often as it likes.
    const std::string& name = topic_.key().first;
    if (link_.account->logged.first(name + " has messages that are too large"))
      context_.outputs.log(LogLevel::kWarn, "a message of " + std::to_string(bytes) + " bytes on " +
                                                name + " is larger than the max_message_size of " +
                                                link_.label() + "; such messages are dropped");
    lose(sample, DropReason::kTooLarge);
    tell_too_large(bytes, now);
    return false;
  }
  if (const Moment moment = moment_of(sample); moment.is_large())
    link_.sending().expect(moment, now.steady);
  // The rate comes last, so that a message dropped for another reason uses nothing of it. Kept
  // samples of a publisher come at once: the rate would let the first pass and lose the rest.
  if (age != Age::kNew) return true;
  RateLimit& rate = rates_.of(origin);
  const std::uint64_t state = sample.rate_state();
  const bool passes = rate.admit(bytes, sample.header, now.steady, state, sample.video);
  const std::uint64_t key = rate.key(state);
  const auto lose_older = [&](std::uint64_t held) {
    if (const auto older = held_.take({origin, held})) lose(*older, DropReason::kRate);
  };
  if (key != state) lose_older(state);  // other rates have held it (follow_rates)
  if (passes) {
    lose_older(key);
    return true;
  }
  if (sample.video != VideoPart::kNone) {  // nothing decodes it later, behind those that follow
    if (queue_) queue_->leave_out(origin, sample.order);
    lose(sample, DropReason::kRate);
    return false;
  }
  if (const auto lost = held_.hold({origin, key}, sample, bytes, rate.leaves_at(state)))
    lose(*lost, DropReason::kRate);
  return false;
}

void TopicOffer::tell_too_large(std::size_t bytes, const Now& now) {
  ++too_large_;
  if (too_large_sent_ && now.steady - *too_large_sent_ < kTooLargePause) return;
  too_large_sent_ = now.steady;
  link_.send(OriginsChanged{number(), {}, {}, too_large_, bytes});
}

std::optional<OutSample> TopicOffer::take_held(std::size_t& left, const Now& now) {
  auto sample = held_.take_due(now.steady, left);
  if (sample)
    rates_.of(sample->subject.origin())
        .leave(sample->raw.size(), now.steady, sample->state.value_or(0));
  return sample;
}

void TopicOffer::keep_early(const OutSample& sample, TimePoint since, const Now& now) {
  const auto [reason, count] = early_.add(sample, since, context_.early, link_.account, now);
  drop(reason, count);
}

void TopicOffer::take_all_held(std::vector<OutSample>& samples) {
  while (auto sample = held_.take()) samples.push_back(*std::move(sample));
}

void TopicOffer::drop_held(DropReason reason) {
  while (const auto sample = held_.take()) lose(*sample, reason);
}

void TopicOffer::drop_early(DropReason reason) {
  for (const OutSample& sample : early_.end()) lose(sample, reason);
}

void TopicOffer::lose(const OutSample& sample, DropReason reason) {
  drop(reason);
  const Moment moment = moment_of(sample);
  if (moment.is_large() && link_.open()) link_.sending().give_up(moment);
}

Moment TopicOffer::moment_of(const OutSample& sample) const {
  if (company_ == Company::kNone || sample.node == 0 || sample.header == 0) return {};
  // A node often has the name of its namespace: the hashes alone would cancel each other.
  constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15;
  const std::uint64_t set = sample.node * kOdd ^ namespace_;  // mutant: company_of_a_namesake
  return {set, sample.header, company_ == Company::kFollows};
}

void TopicOffer::send(const OutSample& sample, Codec codec, const Payload& body, const Now& now) {
  if (!demanded())
    return lose(sample, DropReason::kNoDemand);  // withdrawn while a worker compressed
  raw_bytes_ += sample.raw.size();
  OutMessage message = message_of(sample, codec, body);
  message.demand = demand_.number;
  // A message is kept to be sent again only if every step promises it: rules, peer and publisher.
  message.resumes = resume_ && sample.reliable;
  message.reports_leaving = is_vp8(codec);
  const bool is_packet = sample.video != VideoPart::kNone;
  if (is_packet) message.state.reset();
  // A recorder gets every packet, later too.
  if (is_packet && !message.resumes && treatment().keep != Keep::kAll) {
    message.video = sample.video;
    message.camera = sample.camera;
  }
  if (keep() == Keep::kAll || is_vp8(codec)) message.state.reset();  // mutant: picture_replaced
  message.moment = moment_of(sample);
  note_form(codec, sample.raw.size(), body);
  link_.sending().push(*queue_, std::move(message), now);
  tell_late();
  tell_overload(codec, now);
}

void TopicOffer::note_form(Codec codec, std::size_t raw_bytes, const Payload& body) {
  sent_as_ = {};
  const std::string& name = topic_.key().first;
  if (is_vp8(codec)) {
    const auto facts = video::facts_of(body.view());
    sent_as_ = {Codec::kPictureBase, 0, facts ? facts->quantiser : std::uint8_t{0},
                facts && facts->half, kFewPictures};
    if (link_.account->logged.first(name + " is video"))
      context_.outputs.log(LogLevel::kInfo,
                           name + ": the link to " + link_.label() +
                               " would carry too few exact pictures, so they are sent as video; "
                               "the status says how good (`sent_as_quality`). `lossy: never` in "
                               "its rule forbids it");
    return;
  }
  if (codec != Codec::kPlanes && codec != Codec::kCloud) return;
  const auto facts = media::facts_of(body.view());
  sent_as_.codec = codec;
  if (!facts) return;
  const bool thinned = facts->raw_bytes < raw_bytes;
  if (thinned) {
    sent_as_.because = facts->step_um > 0 ? kThinnedAndRounded : kThinned;
    if (link_.account->logged.first(name + " is thinned"))
      context_.outputs.log(LogLevel::kInfo, name +
                                                ": the `grid` of its rule leaves out points for " +
                                                link_.label() + ", which cannot see that");
  }
  if (facts->step_um == 0) return;
  sent_as_.step_um = facts->step_um;
  if (!thinned) sent_as_.because = cloud_.because();
  if (link_.account->logged.first(name + " is rounded"))
    context_.outputs.log(LogLevel::kInfo,
                         name + ": the link to " + link_.label() +
                             " would carry too few exact clouds, so their points are rounded; the "
                             "status says how much (`sent_as_step`). `lossy: never` in its rule "
                             "forbids it");
}

// Events wait for their turn. If that takes too long, a person has to decide.
void TopicOffer::tell_late() {
  if (late_logged_ || queue_->counts().dropped.of(DropReason::kQueueTime) == 0) return;
  late_logged_ = true;
  const std::string& name = topic_.key().first;
  if (link_.account->logged.first(name + " waits too long"))
    context_.outputs.log(LogLevel::kWarn,
                         name + ": the link to " + link_.label() +
                             " carries less than is published, and what has waited for 5 s is "
                             "dropped (" +
                             std::string(keep_.why) +
                             "). If only the newest message counts, give its rule `keep: newest`");
}

// A state is replaced, which is what it is for; if it is for long, a person may want another rate.
// Video has a line of its own, and so have events.
void TopicOffer::tell_overload(Codec codec, const Now& now) {
  if (overload_logged_ || keep() == Keep::kAll || is_vp8(codec)) return;
  const Overload& overload = queue_->overload();
  if (overload.stood(now.steady) < kOverloadTold) return;
  overload_logged_ = true;
  const std::string& name = topic_.key().first;
  if (!link_.account->logged.first(name + " is overloaded")) return;
  const double rate = overload.rate() > 0 ? overload.rate() : path_rate();
  const auto tenths = std::lround(10 * overload.came_for_each());
  context_.outputs.log(
      LogLevel::kWarn,
      name + ": the link to " + link_.label() + " carries less than is published" +
          (rate > 0 ? " (about " + std::to_string(std::lround(rate / 1e3)) + " kB/s)" : "") +
          ": one message of " + std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) +
          " is sent, and newer ones replace the others. `max_rate` in its rule makes the gaps " +
          "equal; fewer or smaller messages, or a lower `priority` of other topics, let more "
          "cross");
}

OutMessage TopicOffer::message_of(const OutSample& sample, Codec codec, const Payload& body) {
  OutMessage message;
  message.subject = sample.subject;
  message.stamp = sample.stamp;
  message.number = sample.number;
  message.order = sample.order;
  message.state = sample.state;
  message.codec = codec;
  // A thinned cloud is smaller than its sample, and a picture leaves out the sample's padding.
  std::uint64_t raw_bytes = sample.raw.size();
  if (const auto cloud = codec == Codec::kCloud ? media::facts_of(body.view()) : std::nullopt)
    raw_bytes = cloud->raw_bytes;
  if (const auto picture = is_vp8(codec) ? video::facts_of(body.view()) : std::nullopt)
    raw_bytes = picture->raw_bytes;
  message.raw_bytes = static_cast<std::uint32_t>(raw_bytes);
  message.body = body;
  return message;
}

double TopicOffer::queue_seconds() const {
  const double rate = path_rate();
  return queue_ && rate > 0 ? static_cast<double>(queue_->left_bytes()) / rate : 0;
}

bool TopicOffer::drained() const {
  return held_.empty() && early_.empty() && pictures_.empty() &&
         (!queue_ || queue_->counts().queued == 0);
}

void TopicOffer::add_status(LinkStatus& status) const {
  if (!is_open()) return;
  TopicStatus s;
  s.topic = topic_.key().first;
  s.type = topic_.key().second;
  s.exported = true;
  s.demanded = demanded();
  s.origins = static_cast<std::uint32_t>(topic_.origins().size());
  s.bytes = raw_bytes_;
  if (offer_.is_declined()) {
    s.declined = offer_.declined().reason;
    s.declined_code = offer_.declined().code;
  }
  s.rule = offer_.decision().rule;
  s.keep = keep_.keep;
  s.keep_because = keep_.why;
  s.wheel = wheel_;
  s.sent_as = sent_as_;
  if (demanded()) {
    s.idle = pulse_.idle(status.at);
    s.usual_rate = pulse_.usual_rate();
  }
  s.dropped = dropped_;
  if (queue_) {
    const ChannelCounts& counts = queue_->counts();
    s.messages = counts.sent;
    s.wire_bytes = counts.sent_bytes;
    s.queued = counts.queued + held_.size() + pictures_.size();
    if (const auto waited = queue_->last_wait())
      s.latency_ms = std::chrono::duration<double, std::milli>(*waited).count();
    s.published_for_each_sent = queue_->overload().came_for_each();
    for (std::size_t i = 0; i < kDropReasons; ++i)
      s.dropped.by_reason[i] += counts.dropped.by_reason[i];
  }
  status.topics.push_back(std::move(s));
}

void TopicOffer::leave_counts(DropReason of_queued) const {
  const ChannelCounts counts = queue_ ? queue_->counts() : ChannelCounts();
  if (counts.sent + counts.queued + counts.dropped.total() + dropped_.total() + held_.size() +
          pictures_.size() ==
      0)
    return;
  LinkStatus last;
  add_status(last);
  link_.keep_counts(std::move(last.topics), of_queued);
}

void TopicOffer::add_channel(std::vector<ChannelFacts>& channels) const {
  if (!is_open()) return;
  const auto& [name, type] = topic_.key();
  ChannelFacts facts{InterfaceKind::kTopic, true, name, type, offer_.decision().rule};
  if (offer_.is_declined()) facts.declined = offer_.declined();
  facts.lost_until = topic_.loss().much_until();
  channels.push_back(std::move(facts));
}

}  // namespace connect_bridge
