#include "core/link/link.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "core/wire/text.hpp"

namespace connect_bridge {
namespace {

// Limit of ended request channels whose end the peer has not confirmed; a peer that follows the
// protocol confirms it within a round trip.
constexpr std::uint32_t kEndedChannelsMax = 4096;
constexpr std::size_t kPastTopicsMax = 4096;  // topics whose counts a lost connection leaves
constexpr std::size_t kRatesMax = 4096;       // publishers whose rates are remembered
constexpr Duration kRatesReview = std::chrono::seconds(1);

// Estimated memory of one map entry with these two strings.
template <class Entry>
std::uint64_t bytes_of(const std::string& name, const std::string& type) {
  constexpr std::uint64_t kOfMap = 160;
  return kOfMap + sizeof(Entry) + name.size() + type.size();
}

}  // namespace

// ---- the connection

void Link::opened(std::unique_ptr<Connection> connection, const Now& now) {
  connection_ = std::move(connection);
  const Peer& peer = connection_->peer();
  peer_ = {peer.side, peer.address, peer.node};
  login.set_session(peer.session);
  connection_->carry(*this, &memory);
  connection_->name_texts(received_texts_);
  base_ = digest_of(received_texts_);
  names_base_ = true;
  life.opened(now);
  if (!breaks_.empty() && breaks_.back().back == 0) breaks_.back().back = now.system;
}

void Link::lose(Loss loss, const Now& now) {
  life.lost(loss, connection_->dead_at(), now);
  connection_->close();
  channels_.release();  // another link of the identity may offer as many
}

void Link::keep_texts() {
  const Bytes& sent = connection_->outbox().texts().kept();
  const Bytes& received = connection_->texts().kept();
  if (!sent.empty()) {
    sent_texts_ = sent;
    sent_digest_ = digest_of(sent);
  }
  if (!received.empty()) received_texts_ = received;
  const std::uint64_t bytes = sent_texts_.size() + received_texts_.size();
  texts_held_.release();
  if (!life.may_return() || bytes > memory.room()) return forget_texts();
  texts_held_ = memory.hold(bytes);
}

void Link::forget_texts() {
  sent_texts_ = received_texts_ = {};
  sent_digest_ = {};
  texts_held_.release();
}

void Link::drop_connection() {
  if (connection_) keep_texts();
  incoming_.clear();
  declined_.clear();
  sent_findings_.clear();
  peer_findings_.clear();
  outgoing_.clear();
  offered_ = ended_ = 0;
  login.lost();
  accepts.lost();
  connection_.reset();
}

void Link::on_time(const Now& now) {
  if (connection_) connection_->on_time(now);
  if (const auto result = take_accepts(now); !result) fail(result.error());
}

std::optional<TimePoint> Link::deadline() const {
  if (end.goes_on_at) return end.goes_on_at;
  std::optional<TimePoint> first = earliest(life.deadline(), accepts.deadline());
  if (connection_) first = earliest(first, connection_->deadline());
  return earliest(first, login.deadline());
}

// ---- channels

void Link::let_go(ChannelId number) {
  const auto it = incoming_.find(number);
  if (it == incoming_.end() || !it->second.channel) return;
  it->second.channel = nullptr;
  if (!it->second.offered) ++ended_;
}

void Link::forget(ChannelId number) {
  const auto it = incoming_.find(number);
  if (it == incoming_.end()) return;
  if (it->second.offered) channels_.resize(--offered_);
  if (!it->second.offered && !it->second.channel) --ended_;
  incoming_.erase(it);
  declined_.erase(number);
}

void Link::decline(ChannelId number, InterfaceKind kind, std::pair<std::string, std::string> key,
                   const Ending& why) {
  send(Decline{number, why.code, why.reason});
  if (declined_.size() < kDeclinedMax || declined_.contains(number))
    declined_[number] = {kind, std::move(key), why};
}

void Link::resume_incoming(ChannelId number, std::uint32_t sequence) {
  if (Incoming* const channel = incoming(number)) channel->stream.go_on(sequence);
}

void Link::withdraw(ChannelId number, const Ending& why) {
  close_channel(number);
  if (connection_) sending().remove_channel(number);
  send(why.code.empty() ? Withdraw{{number}} : Withdraw{{number}, why.code, why.reason});
}

// ---- status

void Link::send_findings(const std::vector<PeerFinding>& findings) {
  Findings told;
  for (const PeerFinding& finding : findings) {
    if (told.list.size() == kFindingsMax) break;
    auto name = finding.name.empty() ? std::optional<std::string>(std::string())
                                     : names.to_wire(finding.name);
    if (name) told.list.push_back({finding.id, *std::move(name)});
  }
  if (told.list == sent_findings_) return;
  sent_findings_ = told.list;
  send(told);
}

// The peer's words are shown to people, so only names are taken.
Result<Nothing> Link::on(Findings& findings, const Now&) {
  peer_findings_.clear();
  for (PeerFinding& finding : findings.list) {
    if (!finding.name.empty() && !is_canonical_name(finding.name)) continue;
    if (!finding.name.empty()) finding.name = names.to_local(finding.name);
    peer_findings_.push_back(std::move(finding));
  }
  return Nothing{};
}

void Link::note_break(Failure why, bool by_peer, const Now& now) {
  if (breaks_.size() == LinkBreak::kShownMax) breaks_.pop_front();
  why.text = to_text(why.text, LinkBreak::kReasonBytesMax);
  breaks_.push_back({now.system, 0, std::move(why), by_peer});
}

LinkStatus Link::status() const {
  LinkStatus shown;
  shown.number = id.value;
  shown.peer = peer_.address;
  shown.node = peer_.node;
  shown.identity = login.identity().name;
  shown.open = open();
  shown.connects = life.connects();
  shown.breaks.assign(breaks_.begin(), breaks_.end());
  shown.mirrors_waited = mirrors.waited();
  shown.memory_bytes = memory.used();
  if (!connection_) return shown;
  shown.connection = connection_->id();
  shown.peer_findings = peer_findings_;
  shown.login_end = login.end(connection_->peer().expires);
  const Outbox& outbox = connection_->outbox();
  shown.sent_bytes = connection_->sent_bytes();
  shown.received_bytes = connection_->received_bytes();
  shown.queued_bytes = outbox.data_bytes() + outbox.kept_bytes();
  shown.unacknowledged_bytes = outbox.unacknowledged_bytes();
  shown.rate = outbox.pacer().rate();
  shown.path_queue = outbox.pacer().queue();
  const ClockEstimate& clock = connection_->clock();
  shown.clock = {clock.known(), clock.offset(),          clock.round_trip(), clock.error_bound(),
                 clock.total(), clock.last().round_trip, clock.last().offset};
  return shown;
}

std::uint64_t Link::memory_bytes() const {
  if (!connection_) return 0;
  const Outbox& outbox = connection_->outbox();
  return outbox.data_bytes() + outbox.kept_bytes() + connection_->open_bytes();
}

void Link::keep_counts(std::vector<TopicStatus> topics, DropReason of_queued) {
  for (auto& topic : topics) {
    topic.dropped.add(of_queued, topic.queued);
    if (topic.messages + topic.dropped.total() == 0) continue;
    const std::tuple key{topic.exported, topic.topic, topic.type};
    const std::uint64_t bytes = bytes_of<Past>(topic.topic, topic.type);
    const bool fits = past_.size() < kPastTopicsMax && bytes <= memory.room();
    if (!fits && !past_.contains(key)) continue;
    Past& past = past_[key];
    if (past.held.amount() == 0) past.held = memory.hold(bytes);
    past.counts.add_past(topic);
  }
}

void Link::add_past(TopicStatus& topic) const {
  const auto past = past_.find({topic.exported, topic.topic, topic.type});
  if (past != past_.end()) topic.add_past(past->second.counts);
}

// ---- arrivals

Result<Nothing> Link::on_control(Control& control, const Now& now) {
  return std::visit([&](auto& message) { return on(message, now); }, control);
}

void Link::report_left(const Now& now) {
  for (const ChannelId left : connection_->outbox().take_left())
    if (OutgoingChannel* channel = outgoing(left)) channel->on_left(now);
}

void Link::on_delivered(const Outbox::Delivered& whole, const Now& now) {
  if (OutgoingChannel* channel = outgoing(whole.channel))
    channel->on_delivered(whole.subject.call(), now);
}

Result<Nothing> Link::on(Accepts& accepted, const Now& now) {
  const Token128 base = std::exchange(accepted.base, Token128{});
  if (std::exchange(names_base_, false) && base && base == sent_digest_)
    connection_->outbox().go_on_with(sent_texts_);
  if (accepted.message_bytes_max > 0)
    connection_->set_peer_message_bytes_max(accepted.message_bytes_max);
  accepts.put(std::move(accepted), now);
  return take_accepts(now);
}

Result<Nothing> Link::take_accepts(const Now& now) {
  auto list = accepts.take_due(life.opened_at(), now);
  return list ? user_.on(*this, std::move(*list), now) : Nothing{};
}

RateLimit* Link::rate_of(const std::pair<std::string, std::string>& topic, const Gid& publisher,
                         const Treatment& treatment, const Now& now) {
  if (treatment.max_rate == 0 && treatment.bytes_per_second_max == 0) return nullptr;
  const RateLimit fresh(treatment.max_rate, treatment.bytes_per_second_max);
  auto at = rates_.find({topic, publisher});
  if (at == rates_.end()) {
    if (rates_.size() >= kRatesMax && now.steady >= next_rates_review_) {
      next_rates_review_ = now.steady + kRatesReview;
      std::erase_if(rates_, [&](const auto& entry) { return entry.second.limit.idle(now.steady); });
    }
    // A peer that offers too many publishers at once gets one limit for the rest together.
    const std::uint64_t bytes = bytes_of<Rate>(topic.first, topic.second);
    const bool full = rates_.size() >= kRatesMax || bytes > memory.room();
    at = rates_.try_emplace({topic, full ? Gid{} : publisher}, Rate{fresh, {}}).first;
    if (at->second.held.amount() == 0) at->second.held = memory.hold(bytes);
  }
  // The rules may have changed while nothing came.
  RateLimit& limit = at->second.limit;
  if (!limit.has_rates_of(fresh)) limit = fresh;
  at->second.held.resize(bytes_of<Rate>(topic.first, topic.second) +
                         limit.states() * RateLimit::kStateBytes);
  return &limit;
}

Result<Nothing> Link::on(OriginsChanged& change, const Now& now) {
  const Incoming* const to = incoming(change.channel);
  if (!to) return Error{CloseCode::kUnknownChannel, "origins of a channel that does not exist"};
  if (to->service)
    return Error{CloseCode::kUnknownChannel, "origins of a channel that is no topic"};
  return to->channel ? to->channel->on_origins(change, now) : Nothing{};
}

Result<Nothing> Link::on(Withdraw& withdraw, const Now& now) {
  for (const ChannelId number : withdraw.channels) {
    const auto it = incoming_.find(number);
    if (it == incoming_.end())
      return Error{CloseCode::kUnknownChannel, "a channel that does not exist was withdrawn"};
    IncomingChannel* const channel = it->second.channel;
    const bool was_offered = it->second.offered;
    forget(number);
    if (channel) channel->on_withdraw(withdraw, now);
    if (was_offered && !note_withdrawal(now))
      return Error{CloseCode::kTooLarge, "channels are offered and withdrawn too often"};
  }
  return Nothing{};
}

// A message about a channel that this side has withdrawn crossed the `withdraw` on the way.
Result<Nothing> Link::on(Demand& demand, const Now& now) {
  for (const auto& of_channel : demand.channels) {
    OutgoingChannel* channel = outgoing(of_channel.channel);
    if (!channel) continue;
    channel->on_demand(of_channel, now);
    if (of_channel.number == 0 && !account->demands.take(now.steady))  // mutant: demands_pace
      return Error{CloseCode::kTooLarge, "topics are demanded and not demanded too often"};
  }
  return Nothing{};
}

Result<Nothing> Link::on(Decline& decline, const Now& now) {
  if (OutgoingChannel* channel = outgoing(decline.channel)) channel->on_decline(decline, now);
  return Nothing{};
}

Result<Nothing> Link::on(Attach& attach, const Now& now) {
  if (expects(attach.requests))
    return Error{CloseCode::kIllegal, "a channel of requests has a number that is in use"};
  OutgoingChannel* channel = outgoing(attach.channel);
  if (!channel && !was_opened(attach.channel))
    return Error{CloseCode::kUnknownChannel, "attached to a service that was never offered"};
  // The message crossed our withdraw; the peer ends the channel as soon as it sees that.
  if (!channel) ++ended_;
  if (ended_ > kEndedChannelsMax)
    return Error{CloseCode::kTooLarge, "too many channels of requests are not ended"};
  if (channel) return channel->on_attach(attach, now);
  incoming_[attach.requests] = {nullptr, false};
  return Nothing{};
}

Result<Nothing> Link::on(Attached& attached, const Now& now) {
  const Incoming* const to = incoming(attached.channel);
  if (!to) return Error{CloseCode::kUnknownChannel, "attached to a service that does not exist"};
  return to->channel ? to->channel->on_attached(attached, now) : Nothing{};
}

Result<Nothing> Link::on(Refuse& refuse, const Now& now) {
  const Incoming* const to = incoming(refuse.channel);
  if (!to)
    return Error{CloseCode::kUnknownChannel, "calls of a service that does not exist are refused"};
  return to->channel ? to->channel->on_refuse(refuse, now) : Nothing{};
}

Result<Nothing> Link::on(Forget& forget, const Now& now) {
  if (OutgoingChannel* channel = outgoing(forget.channel)) return channel->on_forget(forget, now);
  if (!was_opened(forget.channel))
    return Error{CloseCode::kUnknownChannel, "calls of a service that was never offered"};
  return Nothing{};
}

// The operator exports the topic, so its channel number stands in both directions.
Result<Nothing> Link::on(Wheel& wheel, const Now& now) {
  if (wheel.state) {
    if (OutgoingChannel* channel = outgoing(wheel.channel)) channel->on_wheel(*wheel.state, now);
    return Nothing{};
  }
  const Incoming* const to = incoming(wheel.channel);
  if (!to || to->service)
    return Error{CloseCode::kUnknownChannel, "the wheel of a topic that does not exist"};
  if (to->channel) to->channel->on_wheel_wanted(*wheel.want, now);
  return Nothing{};
}

}  // namespace connect_bridge
