#include "core/flow/channel_queue.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/base/check.hpp"

// A message is in one of three places, and moves from right to left: sent (`sent_`, only if it
// resumes), open (`open_`, partly handed out), waiting (`waiting_`). What waits begins with what
// goes on after a break (`replay_.count()` messages), which nothing displaces; depth and bytes
// bound the rest. The form in which the first one leaves is decided when it is looked at
// (`front_`), and again whenever another one becomes the first, or the peer's bases change.
namespace connect_bridge {
namespace {

// Messages of a channel that wait for their large ones; beyond it the oldest goes alone.
constexpr std::size_t kApartMost = 128;

// Whether `stamp` lies more than `limit` before now. An unknown time is never too far.
bool is_older(Stamp stamp, Duration limit, const Now& now) {
  if (limit == kForever || stamp == 0 || now.system == 0 || stamp >= now.system) return false;
  // Unsigned, because the difference of two stamps may not fit a Stamp.
  const auto age = static_cast<std::uint64_t>(now.system) - static_cast<std::uint64_t>(stamp);
  return age > static_cast<std::uint64_t>(std::max(limit, Duration::zero()).count());
}

std::uint32_t body_bytes_of(const OutMessage& message) {
  return static_cast<std::uint32_t>(message.body.size());
}

}  // namespace

ChannelQueue::ChannelQueue(ChannelId id, const QueueOptions& options, Budget& bases,
                           Together& together)
    : id_(id), options_(options), together_(together) {
  const Compression& how = options.compression;
  if (how.automatic ? options.priority != Priority::kUrgent : how.codec == Codec::kZstd)
    deltas_.emplace(how, !options.keep, bases);
}

std::optional<DropReason> ChannelQueue::too_old(const OutMessage& message, const Now& now) const {
  if (is_older(message.stamp, options_.lifespan, now))
    return DropReason::kLifespan;  // mutant: lifespan
  if (is_older(message.stamp, options_.max_age, now)) return DropReason::kMaxAge;
  return std::nullopt;
}

std::optional<DropReason> ChannelQueue::refused(const OutMessage& message, const Now& now) const {
  if (message.body.size() > std::numeric_limits<std::uint32_t>::max()) return DropReason::kTooLarge;
  if (const auto reason = too_old(message, now)) return reason;
  if (options_.keep) return std::nullopt;
  const bool keep_all = options_.depth == 0 && !options_.newest_only;
  if (keep_all && !has_room(message.body.size(), now)) return DropReason::kQueueBytes;
  return std::nullopt;
}

bool ChannelQueue::has_room(std::size_t body_bytes, const Now& now, std::size_t gone) const {
  const auto bytes = waiting_bytes_ - replay_.bytes() - gone + body_bytes;
  const auto first = replay_.count();  // that is limited
  if (waiting_.size() == first || bytes <= options_.queue_bytes_max) return true;
  // A burst has more room while the link moves: when its oldest has waited for kStalled the link
  // does not carry what is published, and to keep more would only make all of it late.
  return bytes <= options_.burst_bytes_max && now.steady - waiting_[first].since <= kStalled;
}

void ChannelQueue::push(OutMessage message, std::uint64_t arrival, const Now& now) {
  ++counts_.accepted;
  groups_.came(message);
  if (const auto reason = refused(message, now)) {
    counts_.dropped.add(*reason);
    groups_.dropped(message);
    if (message.moment.is_large()) together_.gone(message.moment);
    return;
  }
  // The protocol requires equal sizes for an uncompressed message.
  if (message.codec == Codec::kNone) message.raw_bytes = body_bytes_of(message);
  count_queued(message);
  if (!message.moment.follows || goes_on()) {
    rejoin(apart_.size(), now);  // the order of the channel stays
    return place(std::move(message), arrival, now);
  }
  apart_.push_back({std::move(message), arrival, now.steady, now.steady});
  settle(now);
  if (apart_.size() > kApartMost) rejoin(1, now);
}

void ChannelQueue::place(OutMessage message, std::uint64_t arrival, const Now& now) {
  const auto body_bytes = message.body.size();
  if (message.video == VideoPart::kKey) drop_older_group(message, now);
  // Bytes alone bound the messages of a replay (Replay::takes). A message joins it only while no
  // other message waits before it, so the order of the channel stays.
  if (options_.newest_only) {
    drop_waiting(DropReason::kNewerAvailable);
  } else if (replay_.count() == waiting_.size() &&
             replay_.takes(message, bytes_max(), now.steady)) {
    replay_.add(body_bytes);
  } else if (!options_.keep && make_room(message, arrival, now)) {
    return;
  }
  enqueue(std::move(message), arrival, now);
}

bool ChannelQueue::make_room(OutMessage& message, std::uint64_t arrival, const Now& now) {
  const auto first = replay_.count();  // of those that may be dropped
  if (empty()) overload_.over();       // mutant: stand_ends
  if (waiting_.size() > first) overload_.came(waiting_[first].since, now.steady);
  if (overload_.stands()) {
    if (message.state) {  // mutant: states_replaced
      replace(std::move(message), arrival, now);
      return true;
    }
    drop_overdue(now);
  }
  // Bytes and time bound packets of a video: the publisher's depth would tear each group.
  const bool is_packet = message.video != VideoPart::kNone;
  while (!is_packet && options_.depth > 0 && waiting_.size() - first >= options_.depth) {
    if (displace(message, arrival, now)) return true;  // mutant: turns_at_depth
    drop_waiting_at(first, DropReason::kQueueDepth);   // mutant: depth
  }
  while (!has_room(message.body.size(), now)) {
    if (message.state && displace(message, arrival, now)) return true;
    drop_waiting_at(first, DropReason::kQueueBytes);
  }
  return false;
}

// Events are not replaced, but nobody waits for one that has waited so long. A message came no
// earlier than the place that it has taken.
void ChannelQueue::drop_overdue(const Now& now) {
  for (auto i = replay_.count();
       i < waiting_.size() && now.steady - waiting_[i].since > kWaitMax;) {
    if (now.steady - waiting_[i++].came > kWaitMax) drop_waiting_at(--i, DropReason::kQueueTime);
  }
}

// The link is behind, and a decoder needs none of them for the new group. What came just now does
// not wait for the link.
void ChannelQueue::drop_older_group(const OutMessage& key, const Now& now) {
  for (auto i = waiting_.size(); i-- > replay_.count();) {
    const OutMessage& message = waiting_[i].message;
    if (message.subject == key.subject && message.video != VideoPart::kNone &&
        message.camera == key.camera && waiting_[i].since < now.steady)
      drop_waiting_at(i, DropReason::kNewerAvailable);
  }
}

// On a link that carries less than is published, only the newest of each state waits behind the
// message under way (docs/flow.md section 4): as many arrive, and each of them sooner. The newest
// takes the place of the oldest; without one it gets its publisher's turn.
void ChannelQueue::replace(OutMessage message, std::uint64_t arrival, const Now& now) {
  const auto is_older = [&](const Waiting& waiting) {
    return waiting.message.subject == message.subject && waiting.message.state == message.state;
  };
  const auto first = replay_.count();
  std::size_t oldest = waiting_.size();
  for (auto i = waiting_.size(); i-- > first;) {
    if (!is_older(waiting_[i])) continue;
    overload_.replaced();
    if (oldest < waiting_.size()) drop_waiting_at(oldest, DropReason::kNewerAvailable);
    oldest = i;
  }
  if (oldest < waiting_.size()) {
    count_dropped(waiting_[oldest].message, DropReason::kNewerAvailable);
    waiting_bytes_ += message.body.size() - waiting_[oldest].message.body.size();
    if (oldest == 0) front_.reset();
    waiting_[oldest].put(std::move(message), now.steady);
  } else {
    enqueue(std::move(message), arrival, now);
    take_turn(first);
  }
  drop_last(first, now);
}

// The last one goes before those whose publishers had their turns later: else the same ones get
// through for ever where periods and the link's fall together. The places stay where they are.
void ChannelQueue::take_turn(std::size_t first) {
  const auto turn_of = [this](const Waiting& waiting) {
    const auto turn = turns_.find(waiting.message.subject.origin());
    return turn == turns_.end() ? 0 : turn->second;
  };
  const auto own = turn_of(waiting_.back());
  for (auto i = waiting_.size() - 1; i > first; --i) {
    if (turn_of(waiting_[i - 1]) <= own) return;  // mutant: publishers_turns
    std::swap(waiting_[i - 1], waiting_[i]);
    std::swap(waiting_[i - 1].since, waiting_[i].since);
    if (i == 1) front_.reset();
  }
}

bool ChannelQueue::displace(OutMessage& message, std::uint64_t arrival, const Now& now) {
  const auto is_other = [&](const Waiting& w) { return w.message.subject != message.subject; };
  const auto first = waiting_.begin() + static_cast<std::ptrdiff_t>(replay_.count());
  auto own = std::find_if_not(first, waiting_.end(), is_other);
  if (own == waiting_.end() && message.state) {
    enqueue(std::move(message), arrival, now);
    take_turn(replay_.count());
    drop_last(replay_.count(), now);
    return true;
  }
  if (own == waiting_.end() || std::none_of(first, waiting_.end(), is_other)) return false;
  const std::size_t gone = own->message.body.size();
  if (!has_room(message.body.size(), now, gone)) return false;
  count_dropped(own->message, DropReason::kQueueDepth);
  waiting_bytes_ += message.body.size() - gone;
  if (own == waiting_.begin()) front_.reset();
  for (auto next = own + 1; next != waiting_.end(); ++next) {
    if (is_other(*next)) continue;
    own->put(std::move(next->message), next->came);
    own = next;
  }
  own->put(std::move(message), now.steady);
  return true;
}

void ChannelQueue::go_on(std::deque<OutMessage> messages, std::uint64_t& arrivals, const Now& now,
                         TimePoint until) {
  CONNECT_CHECK(empty());
  replay_.begin(now.steady, until);
  for (auto& message : messages) {
    ++counts_.accepted;
    replay_.add(message.body.size());
    count_queued(message);
    enqueue(std::move(message), ++arrivals, now);
  }
}

std::deque<OutMessage> ChannelQueue::take_unarrived() {
  std::deque<OutMessage> taken;
  // In this order they were accepted: first what was sent, then what is partly sent, then what
  // waits.
  resend_bytes_ = 0;
  for (auto& [message, bytes] : std::exchange(sent_, {})) {
    --counts_.sent;
    counts_.sent_bytes -= bytes;
    taken.push_back(std::move(message));
  }
  while (!apart_.empty()) {
    waiting_bytes_ += apart_.front().message.body.size();
    waiting_.push_back(std::move(apart_.front()));
    apart_.pop_front();
  }
  const auto forget_queued = [this](std::size_t bytes) {
    --counts_.queued;
    counts_.queued_bytes -= bytes;
  };
  if (open_ && open_->message.resumes) {
    forget_queued(open_->message.body.size());
    taken.push_back(unprepared(*std::exchange(open_, std::nullopt)));
  }
  for (std::size_t i = 0; i < waiting_.size();) {
    if (!waiting_[i].message.resumes) {
      ++i;
      continue;
    }
    taken.push_back(take_waiting(i));
    forget_queued(taken.back().body.size());
  }
  counts_.accepted -= taken.size();
  return taken;
}

bool ChannelQueue::ready(const Now& now) {
  if (open_) return true;
  while (!waiting_.empty()) {
    const OutMessage& first = waiting_.front().message;
    auto reason = too_old(first, now);
    if (!reason && groups_.misses(first)) reason = DropReason::kGroup;
    if (!reason) return true;
    drop_oldest_waiting(*reason);
  }
  return false;
}

void ChannelQueue::prepare(double rate) {
  if (open_ || front_) return;
  front_.emplace();
  const auto& message = waiting_.front().message;
  // Against what the peer has now; what keep-last drops before it leaves does no harm to the bases.
  if (deltas_ && message.codec == Codec::kNone)
    front_->smaller = deltas_->encode({message.subject, message.demand, message.body}, rate);
}

std::size_t ChannelQueue::next_part_bytes(std::uint32_t fragment_bytes) const {
  if (open_) {
    return kPartHeaderBytes +
           std::min(fragment_bytes, body_bytes_of(open_->message) - open_->offset);
  }
  const bool smaller = front_ && front_->smaller;
  const auto body_bytes = smaller ? static_cast<std::uint32_t>(front_->smaller->bytes.size())
                                  : body_bytes_of(waiting_.front().message);
  return kMessageHeaderBytes + std::min(fragment_bytes, body_bytes);
}

std::optional<ChannelQueue::Whole> ChannelQueue::take_part(std::uint32_t fragment_bytes,
                                                           PacketBuilder& packet, const Now& now) {
  rests_until_.reset();
  if (open_) {
    const auto size = std::min(fragment_bytes, body_bytes_of(open_->message) - open_->offset);
    const auto& body = open_->message.body;
    packet.add(PartFrame{id_, false, body.view().subspan(open_->offset, size)}, body, open_->offset,
               size);
    open_->offset += size;
    if (open_->offset < body.size()) return std::nullopt;
    return end(std::move(*std::exchange(open_, std::nullopt)), now);
  }
  CONNECT_CHECK(!waiting_.empty());
  Open next = begin(now);
  auto& message = next.message;
  const auto body_bytes = body_bytes_of(message);
  const auto size = std::min(fragment_bytes, body_bytes);
  // When it begins, so that what was dropped before leaves no gap. What goes on after a break has
  // its number from the connection before (docs/protocol.md section 8.10).
  if (message.sequence == 0)  // mutant: resumed_numbers
    message.sequence = sequence_ =
        sequence_ == std::numeric_limits<std::uint32_t>::max() ? 1 : sequence_ + 1;
  packet.add(MessageFrame{message, id_, body_bytes, message.body.view().first(size)}, message.body,
             0, size);
  if (size == body_bytes) return end(std::move(next), now);
  next.offset = size;
  open_.emplace(std::move(next));
  return std::nullopt;
}

ChannelQueue::Open ChannelQueue::begin(const Now& now) {
  auto front = std::exchange(front_, std::nullopt);
  overload_.began(waiting_.front().since, now.steady);
  last_wait_ = now.steady - waiting_.front().came;
  groups_.left(waiting_.front().message);
  Open next{take_waiting(0), 0, now.steady, {}, {}};
  if (next.message.state) turns_[next.message.subject.origin()] = counts_.sent + 1;
  replay_.begun(bytes_max(), now.steady);
  if (!front || !front->smaller) return next;
  auto& message = next.message;
  // From here on it counts as it leaves; `raw` stays, as the next base and for another connection.
  counts_.queued_bytes -= message.body.size() - front->smaller->bytes.size();
  next.raw = std::exchange(message.body, front->smaller->bytes);
  message.codec = front->smaller->codec;
  next.room = std::move(front->smaller->room);
  return next;
}

std::optional<ChannelQueue::Whole> ChannelQueue::end(Open whole, const Now& now) {
  const auto& message = whole.message;
  ++counts_.sent;
  counts_.sent_bytes += message.body.size();
  --counts_.queued;
  counts_.queued_bytes -= message.body.size();
  overload_.sent(now.steady - whole.since, message.body.size());
  if (goes_on() && replay_.next_at() > now.steady) rests_until_ = replay_.next_at();
  if (deltas_)
    deltas_->sent({message.subject, message.demand, whole.raw}, message.codec,
                  std::move(whole.room));
  if (message.moment.is_large()) together_.left(message.moment);
  const Whole result{message.subject, message.sequence, message.resumes, message.tracked,
                     message.reports_leaving};
  if (!result.tracked && !result.resumes && !result.reports_leaving) return std::nullopt;
  const auto bytes = message.body.size();
  if (result.resumes) keep_sent(unprepared(std::move(whole)), bytes);  // mutant: resent
  return result;
}

// On another connection the peer has other bases, so the message must be prepared again.
OutMessage ChannelQueue::unprepared(Open open) {
  if (open.raw.empty()) return std::move(open.message);
  open.message.body = std::move(open.raw);
  open.message.codec = Codec::kNone;
  return std::move(open.message);
}

void ChannelQueue::drop_oldest_waiting(DropReason reason) {
  if (!waiting_.empty()) return drop_waiting_at(0, reason);
  count_dropped(apart_.front().message, reason);
  apart_.pop_front();
}

OutMessage ChannelQueue::take_waiting(std::size_t index) {
  OutMessage message = std::move(waiting_[index].message);
  waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(index));
  waiting_bytes_ -= message.body.size();
  if (index == 0) front_.reset();
  if (index < replay_.count()) replay_.remove(message.body.size());
  return message;
}

// ---- what leaves with a large message

Together::Verdict ChannelQueue::judge(const Waiting& next, const Now& now) {
  const auto answer = together_.ask(next.message.moment, next.since, now.steady);
  if (answer.verdict == Together::Verdict::kWait) settles_at_ = std::min(settles_at_, answer.until);
  // An event is not dropped with its picture: it counts by itself.
  const bool goes = answer.verdict == Together::Verdict::kDrop && !next.message.state;
  return goes ? Together::Verdict::kGo : answer.verdict;
}

void ChannelQueue::settle(const Now& now) {
  settles_at_ = TimePoint::max();
  std::size_t leave = 0;
  for (std::size_t i = 0; i < apart_.size();) {
    const auto verdict = judge(apart_[i], now);
    if (verdict == Together::Verdict::kDrop) {
      count_dropped(apart_[i].message, DropReason::kNewerAvailable);  // mutant: not_without_it
      apart_.erase(apart_.begin() + static_cast<std::ptrdiff_t>(i));
      continue;
    }
    ++i;
    if (verdict == Together::Verdict::kGo) leave = i;
  }
  rejoin(leave, now);
}

void ChannelQueue::rejoin(std::size_t count, const Now& now) {
  for (; count > 0; --count) {
    Waiting next = std::move(apart_.front());
    apart_.pop_front();
    place(std::move(next.message), next.arrival, now);
  }
}

}  // namespace connect_bridge
