#include "core/flow/outbox.hpp"

#include <algorithm>
#include <utility>

#include "core/base/check.hpp"
#include "core/compress/compress.hpp"

namespace connect_bridge {
namespace {

constexpr std::uint64_t kAskBytesMin = 4096;
// Texts that are compressed together, unless a single one is longer: so urgent data does not wait
// long for them, and as much as one offer has is decompressed at a time.
constexpr std::size_t kTextsGathered = 16 << 10;
constexpr int kTextsLevel = 3;
// A history may be so many times as long as the texts that are compressed: beyond that the gain,
// some 500 bytes, is not worth a tenth of a millisecond.
constexpr std::size_t kHistoryToTexts = 128;
constexpr double kTurnSeconds = 0.5;
constexpr double kTurnBytesMin = 16 << 10;

// How much of a large message may leave before others of its class have a turn, where the link
// carries so many bytes per second (0: not known).
std::uint64_t turn_bytes(double rate) {
  constexpr std::uint64_t kMost = ClassSchedule::kTurnBytesMost;
  if (rate <= 0) return kMost;
  return static_cast<std::uint64_t>(std::clamp<double>(kTurnSeconds * rate, kTurnBytesMin, kMost));
}

}  // namespace

Outbox::Outbox(OutboxOptions options)
    : options_(bounded(options)),
      pacer_(options_.queue_delay_target),
      cap_(options_.bytes_per_second_max) {
  schedule_.set_turn_bytes(turn_bytes(assumed_rate()));
}

template <class Change>
void Outbox::change(ChannelQueue& queue, Change&& change) {
  const auto before = queue.bytes();
  resend_bytes_ -= queue.resend_bytes();
  change(queue);
  resend_bytes_ += queue.resend_bytes();
  bytes_of(queue) = bytes_of(queue) - before + queue.bytes();
  if (queue.empty()) {
    schedule_.remove(queue);
  } else {
    schedule_.add(queue);
  }
  const auto at = std::find(apart_.begin(), apart_.end(), &queue);
  if (queue.may_settle() && at == apart_.end()) apart_.push_back(&queue);
  if (!queue.may_settle() && at != apart_.end()) apart_.erase(at);
}

void Outbox::settle(const Now& now) {
  together_->settled();
  const auto queues = apart_;
  for (auto* queue : queues) change(*queue, [&](ChannelQueue& of) { of.settle(now); });
}

ChannelQueue& Outbox::add_channel(ChannelId channel, QueueOptions options) {
  // A burst of one topic must not displace waiting messages of others.
  options.burst_bytes_max = std::min(options.burst_bytes_max, options_.data_bytes_max / 4);
  const auto [at, is_new] = queues_.try_emplace(channel, channel, options, *bases_, *together_);
  auto& queue = at->second;
  if (is_new) return queue;
  // Else it keeps its turn: where publishers come and go, a large message would wait for ever.
  if (options.priority != queue.priority()) schedule_.leave_class(queue);
  bytes_of(queue) -= queue.bytes();
  queue.configure(options);
  bytes_of(queue) += queue.bytes();
  if (!queue.empty()) schedule_.add(queue);
  return queue;
}

ChannelCounts Outbox::remove_channel(ChannelId channel) {
  const auto at = queues_.find(channel);
  if (at == queues_.end()) return {};
  change(at->second, [](ChannelQueue& queue) {
    queue.drop_open(DropReason::kWithdrawn);
    queue.drop_waiting(DropReason::kWithdrawn);
    queue.forget_sent();
  });
  small_.forget(channel);
  const auto counts = at->second.counts();
  queues_.erase(at);
  return counts;
}

void Outbox::clear_channel(ChannelId channel, DropReason reason) {
  const auto at = queues_.find(channel);
  if (at == queues_.end()) return;
  change(at->second, [&](ChannelQueue& queue) {
    if (queue.drop_open(reason)) small_.abort(channel);
    queue.drop_waiting(reason);
    queue.forget_bases();
    queue.forget_sent();
  });
}

bool Outbox::take_back(ChannelId channel, Subject subject) {
  const auto at = queues_.find(channel);
  bool taken = false;
  if (at != queues_.end())
    change(at->second, [&](ChannelQueue& queue) { taken = queue.take_back(subject); });
  return taken;
}

void Outbox::go_on(ChannelId channel, Unarrived left, const Now& now, TimePoint until) {
  const auto at = queues_.find(channel);
  if (at == queues_.end()) return;
  schedule_.leave_class(at->second);
  at->second.set_light(false);  // many messages come at once
  at->second.restart(left.last_sequence);
  change(at->second, [&](ChannelQueue& queue) {
    queue.go_on(std::move(left.messages), arrivals_, now, until);
  });
  if (is_over()) keep_data_budget(at->second.priority());
}

Outbox::Unarrived Outbox::take_unarrived(ChannelId channel) {
  Unarrived result;
  const auto at = queues_.find(channel);
  if (at == queues_.end()) return result;
  change(at->second, [&](ChannelQueue& queue) {
    result.messages = queue.take_unarrived();
    result.last_sequence = queue.last_sequence();
  });
  held_.resize(held_bytes());  // whoever takes them counts them
  return result;
}

void Outbox::push(ChannelId channel, OutMessage message, const Now& now) {
  if (const auto at = queues_.find(channel); at != queues_.end())
    push(at->second, std::move(message), now);
}

void Outbox::push(ChannelQueue& queue, OutMessage message, const Now& now) {
  judge_weight(queue, message.body.size(), now);
  change(queue, [&](ChannelQueue& to) { to.push(std::move(message), ++arrivals_, now); });
  if (is_over()) keep_data_budget(queue.priority());  // mutant: data_budget
}

bool Outbox::is_over() {
  held_.resize(held_bytes());
  return data_bytes_ > options_.data_bytes_max || held_.is_full();  // mutant: outbox_memory
}

void Outbox::judge_weight(ChannelQueue& queue, std::size_t body_bytes, const Now& now) {
  const bool light = queue.may_be_light(body_bytes) && light_.ready(now.steady);
  if (light) light_.take(kMessageHeaderBytes + body_bytes, pacer_.rate(), cap_.rate(), now.steady);
  if (light == queue.is_light()) return;
  schedule_.leave_class(queue);
  queue.set_light(light);
  if (!queue.empty()) schedule_.add(queue);
}

void Outbox::keep_data_budget(Priority newest) {
  // From bulk up to the class of the new message: it displaces messages of lower classes, never of
  // a higher one. In its own class a waiting message (at the latest the new one itself) is dropped
  // before an open one; otherwise no open message would ever be completed.
  for (int i = kPriorities - 1; i >= static_cast<int>(newest); --i) {
    while (is_over() && drop_one_of(static_cast<Priority>(i))) {
    }
  }
}

bool Outbox::drop_one_of(Priority priority) {
  ChannelQueue* oldest = nullptr;
  ChannelQueue* open = nullptr;
  const auto look_at = [&](ChannelQueue* queue) {
    if (queue->keeps() || queue->priority() != priority) return;
    if (queue->is_open()) open = queue;
    const auto arrival = queue->oldest_waiting();
    if (arrival && (oldest == nullptr || *arrival < *oldest->oldest_waiting())) oldest = queue;
  };
  for (const auto* some : {&schedule_.queues(priority), &schedule_.light(), &schedule_.resting(),
                           &std::as_const(apart_)})
    for (auto* queue : *some) look_at(queue);
  const auto why =
      data_bytes_ > options_.data_bytes_max ? DropReason::kQueueBytes : DropReason::kMemory;
  if (oldest != nullptr) {
    change(*oldest, [&](ChannelQueue& queue) { queue.drop_oldest_waiting(why); });
    return true;
  }
  if (open == nullptr) return false;
  small_.abort(open->id());
  change(*open, [&](ChannelQueue& queue) { queue.drop_open(why); });
  return true;
}

std::optional<Packet> Outbox::next(const Now& now, const Repairs& repairs) {
  pacer_.repairs(repairs);
  if (must_settle()) settle(now);
  held_until_.reset();
  held_.resize(held_bytes());
  schedule_.set_turn_bytes(turn_bytes(assumed_rate()));
  // Measurements of the link take turns with control texts, and so does urgent data. Other data
  // follows, since it may need what the texts announce.
  bool data_turn = controls_.empty();
  if (!data_turn && !(small_.waits() && std::exchange(small_first_, !small_first_))) {
    const auto* const first = schedule_.front();
    data_turn = first && passes_texts(*first) && std::exchange(data_first_, !data_first_);
    if (!data_turn) return next_control(now);
  }
  small_.leave(packet_);
  const bool holds_data = data_turn && !small_.aborts_wait() && add_data(now);
  if (packet_.empty() && !controls_.empty()) return next_control(now);
  if (packet_.empty()) return std::nullopt;
  cap_.sent(packet_.size() + kAckRequestBytes, now.steady);
  // Data that the cap holds back does not wait for the path, so nothing about the path's rate can
  // be learnt from it.
  const bool more_data = !schedule_.empty() && !cap_.holds(now.steady);
  // Whatever is in the packets: ask for an acknowledgement before the window is full.
  const auto ask_bytes = std::max(options_.unacknowledged_bytes_max / 4, kAskBytesMin);
  const bool asks = (holds_data && pacer_.wants_ack(packet_.size(), more_data, now.steady)) ||
                    std::max(sent_bytes_ - asked_end_, kept_since_ask_) >= ask_bytes;
  if (asks) packet_.add(AckRequest{});
  sent_bytes_ += packet_.size();
  if (asks) {
    asked_end_ = sent_bytes_;
    kept_since_ask_ = 0;
  }
  if (holds_data) {
    pacer_.sent(
        {sent_bytes_, static_cast<std::uint32_t>(packet_.size()), now.steady, asks, more_data});
  }
  in_flight_.packet_ends(sent_bytes_);
  auto packet = packet_.finish();
  packet.unsent_bytes_max = pacer_.unsent_bytes();
  packet.more = more_waits();
  return packet;
}

Outbox::ControlText Outbox::take_control() {
  ControlText text = std::move(controls_.front());
  controls_.pop_front();
  control_bytes_ -= text.text.size();
  ++texts_left_;
  return text;
}

Packet Outbox::next_control(const Now& now) {
  if (auto packet = next_compressed(now)) return *std::move(packet);
  const auto [text, completes, plain] = take_control();
  if (completes) texts_.keep();
  Packet packet;
  packet.text = true;
  packet.pieces.push_back(Payload::adopt(Bytes(text.begin(), text.end())));
  cap_.sent(packet.size(), now.steady);
  packet.more = more_waits();
  return packet;
}

std::optional<Packet> Outbox::next_compressed(const Now& now) {
  // The compressor indexes the whole history, however short the texts are.
  const std::size_t least =
      std::max(options_.compressed_texts_min, texts_.texts().size() / kHistoryToTexts);
  if (control_bytes_ < least) return std::nullopt;
  Bytes raw;
  std::size_t count = 0;
  for (; count < std::min(controls_.size(), kTextsMax); ++count) {
    const std::string& text = controls_[count].text;
    if (controls_[count].plain) break;  // mutant: plain_renew
    if (raw.size() + text.size() + 1 > (count == 0 ? kTextsRawMax : kTextsGathered)) break;
    if (count > 0) raw.push_back('\n');
    raw.insert(raw.end(), text.begin(), text.end());
  }
  if (raw.size() < least) return std::nullopt;
  auto body = compress_delta(raw, texts_.texts(), kTextsLevel);
  if (!body) return std::nullopt;
  texts_.add(raw);
  bool completes = false;
  for (; count > 0; --count) completes = take_control().completes || completes;
  if (completes) texts_.keep();
  const Payload whole = Payload::adopt(*std::move(body));
  packet_.add(TextsFrame{std::exchange(refers_to_kept_, false),
                         static_cast<std::uint32_t>(raw.size()), whole.view()},
              whole, 0, whole.size());
  cap_.sent(packet_.size(), now.steady);
  sent_bytes_ += packet_.size();
  auto packet = packet_.finish();
  packet.more = more_waits();
  return packet;
}

void Outbox::follow_texts(ChannelId channel) {
  if (const auto at = queues_.find(channel); at != queues_.end())
    at->second.follow_texts(texts_pushed_);
}

// Calls wait for the texts: a demand for an action's feedback leaves before its goal.
bool Outbox::passes_texts(const ChannelQueue& queue) const {
  const bool is_first = queue.priority() == Priority::kUrgent || queue.is_light();
  return controls_.empty() || (is_first && !queue.keeps() && queue.texts_before() <= texts_left_);
}

bool Outbox::add_data(const Now& now) {
  const std::uint32_t part_max = pacer_.part_bytes(cap_.part_bytes(options_.fragment_bytes));
  const std::uint32_t gather_max = pacer_.part_bytes(cap_.part_bytes(options_.packet_bytes));
  bool added = false;
  while (packet_.takes_more(gather_max)) {
    auto* queue = next_queue(now);
    if (queue == nullptr || !passes_texts(*queue)) break;
    const auto part = queue->next_part_bytes(part_max);
    const auto packet_bytes = packet_.size() + part;
    // A part that is too large for any gathered packet ends this packet; a part that fits the next
    // packet waits for it.
    if (!packet_.empty() && packet_bytes > gather_max && part <= gather_max) break;
    if (!may_leave(*queue, packet_bytes, now)) break;
    take_part(*queue, part_max, now);
    added = true;
    if (queue->empty()) {
      schedule_.sent_all(part);
    } else {
      schedule_.sent(part);
    }
    if (must_settle()) settle(now);
  }
  return added;
}

bool Outbox::may_leave(const ChannelQueue& queue, std::size_t packet_bytes, const Now& now) {
  if (!window_allows(queue, packet_bytes)) return false;
  TimePoint at = queue.priority() == Priority::kUrgent ? now.steady : cap_.next_at();
  if (at <= now.steady && queue.is_held()) at = pacer_.next_at(now.steady);
  if (at <= now.steady) return true;
  if (at != Pacer::kNever) held_until_ = at;
  return false;
}

void Outbox::take_part(ChannelQueue& queue, std::uint32_t part_max, const Now& now) {
  const auto before = queue.bytes();
  const auto kept_before = queue.resend_bytes();
  const auto whole = queue.take_part(part_max, packet_, now);
  resend_bytes_ += queue.resend_bytes() - kept_before;
  kept_since_ask_ += queue.resend_bytes() - kept_before;
  bytes_of(queue) = bytes_of(queue) - before + queue.bytes();
  if (!whole) return;
  if (whole->tracked || whole->resumes) in_flight_.add({queue.id(), *whole});
  if (whole->reports_leaving) left_.push_back(queue.id());
}

ChannelQueue* Outbox::next_queue(const Now& now) {
  while (auto* queue = schedule_.front()) {
    const auto before = queue->bytes();
    const bool ready = queue->ready(now);
    bytes_of(*queue) = bytes_of(*queue) - before + queue->bytes();
    if (ready) {
      queue->prepare(assumed_rate());
      return queue;
    }
    schedule_.sent_all(0);
  }
  return nullptr;
}

bool Outbox::window_allows(const ChannelQueue& queue, std::size_t packet_bytes) const {
  const auto reserve = queue.priority() == Priority::kUrgent ? kUrgentReserveBytes : 0;
  const auto sent = unacknowledged_bytes() + packet_bytes + kAckRequestBytes;
  if (sent > options_.unacknowledged_bytes_max + reserve) return false;  // mutant: window
  // A message that was sent compressed may be large in the resend buffer: when that is full, only
  // messages that would be kept as well have to wait.
  return !queue.begins_resuming() || resend_bytes_ <= options_.unacknowledged_bytes_max;
}

std::optional<std::vector<Outbox::Delivered>> Outbox::acknowledge(const Arrival& ack,
                                                                  const Now& now) {
  if (ack.received_bytes > sent_bytes_) return std::nullopt;  // mutant: false_acknowledgement
  std::vector<Delivered> delivered;
  if (ack.received_bytes <= received_bytes_) return delivered;
  pacer_.acknowledged(ack, now.steady);
  received_bytes_ = ack.received_bytes;
  while (const auto arrived = in_flight_.take_arrived(received_bytes_)) {
    const ChannelQueue::Whole& whole = arrived->whole;
    if (!whole.resumes) {
      delivered.push_back({arrived->channel, whole.subject});
    } else if (const auto queue = queues_.find(arrived->channel); queue != queues_.end()) {
      change(queue->second, [&](ChannelQueue& sent) { sent.arrived(whole.sequence); });
    }
  }
  return delivered;
}

ChannelCounts Outbox::counts(ChannelId channel) const {
  const auto at = queues_.find(channel);
  return at == queues_.end() ? ChannelCounts{} : at->second.counts();
}

}  // namespace connect_bridge
