// Control texts and messages that wait to be sent on one link, by priority. The connection pulls.
// One unit: budget, order and pace of one byte stream decide together about each packet.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/base/budget.hpp"
#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/base/timers.hpp"
#include "core/flow/channel_queue.hpp"
#include "core/flow/class_schedule.hpp"
#include "core/flow/in_flight.hpp"
#include "core/flow/light_budget.hpp"
#include "core/flow/link_cap.hpp"
#include "core/flow/outbox_options.hpp"
#include "core/flow/packet.hpp"
#include "core/flow/small_frames.hpp"
#include "core/flow/text_history.hpp"
#include "core/pacing/pacer.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge {

// Not thread-safe; belongs to one link. Order is kept per channel. Small frames come first of
// all, then control texts, which take turns with urgent and light messages that do not need them;
// urgent is strict, light messages follow; high, normal and bulk share by weight 8 : 4 : 1 in
// bytes; in a class small messages overtake large ones (ClassSchedule). At most one message per
// channel is open (partly sent) at a time.
class Outbox {
 public:
  explicit Outbox(OutboxOptions options);
  Outbox(Outbox&&) = default;  // channels keep their addresses, so the schedule stays valid
  Outbox& operator=(Outbox&&) = default;

  // An existing channel gets the new options and keeps its queue and counts. The queue is there
  // until the channel is removed: for push(), to look at it, and to forget a base that the peer
  // forgets, too.
  ChannelQueue& add_channel(ChannelId channel, QueueOptions options);
  using Unarrived = UnarrivedMessages;
  // The channel, on which nothing was sent yet, continues one of an earlier connection: the
  // messages that were left there come first, and the sequence numbers go on (ChannelQueue::go_on).
  void go_on(ChannelId channel, Unarrived left, const Now& now, TimePoint until);
  [[nodiscard]] Unarrived take_unarrived(ChannelId channel);
  // Drops what is queued (counted as kWithdrawn), forgets the channel and returns its last counts.
  // An open message ends without `abort`: send `withdraw` after this call, and the receiver forgets
  // its unfinished message with the channel.
  ChannelCounts remove_channel(ChannelId channel);
  // Drops what is queued and aborts an open message, but keeps channel and counts.
  void clear_channel(ChannelId channel, DropReason reason = DropReason::kNoDemand);
  // Drops the oldest message of the subject that is not begun (kNoDemand). False: there is none.
  bool take_back(ChannelId channel, Subject subject);

  // Queues a message; what the channel's policy displaces is dropped and counted. For a channel
  // that does not exist (any more) it does nothing.
  void push(ChannelId channel, OutMessage message, const Now& now);
  // The same, with the queue that add_channel() has returned.
  void push(ChannelQueue& queue, OutMessage message, const Now& now);
  struct ControlText {
    std::string text;
    bool completes = false;  // the first round of offers ends with it
    bool plain = false;      // it must not be compressed
  };
  // Queues a control text. False beyond control_bytes_max: close the connection with kSlowPeer.
  [[nodiscard]] bool push_control(ControlText text) {
    if (control_bytes_ + text.text.size() > options_.control_bytes_max) return false;
    control_bytes_ += text.text.size();
    controls_.push_back(std::move(text));
    ++texts_pushed_;
    return true;
  }
  // The channel's messages do not overtake the texts that wait now.
  void follow_texts(ChannelId channel);
  // The peer has kept these texts of an earlier connection: compressed ones refer to them from now
  // on.
  void go_on_with(const Bytes& texts) {
    texts_.go_on(texts);
    refers_to_kept_ = true;
  }
  [[nodiscard]] const TextHistory& texts() const { return texts_; }
  // Queues an ack or time frame (SmallFrames::push).
  void push_small(const Frame& frame) { small_.push(frame); }

  // The next packet to hand to the connection, or nullopt when nothing may be sent now.
  std::optional<Packet> next(const Now& now, const Repairs& repairs = {});

  // The channels of messages that report their leaving, and have left since the last call.
  [[nodiscard]] std::vector<ChannelId> take_left() { return std::exchange(left_, {}); }

  // A large message was admitted to one of the channels, and will be pushed, or given up
  // (Together).
  void expect(const Moment& moment, TimePoint now) { together_->expect(moment, now); }
  void give_up(const Moment& moment) { together_->gone(moment); }
  // False: nothing waits, and nothing is on its way for which `repairs` matter: next() need not be
  // called. Most of many connections are so, and it takes time to ask TCP for its repairs.
  [[nodiscard]] bool may_have_packet() const {
    return more_waits() || must_settle() || held_until_ || pacer_.measures() ||
           held_.amount() != held_bytes();
  }

  // Nothing that is urgent or light waits, and no control text or small frame: only what may leave
  // a little later.
  [[nodiscard]] bool may_wait() const {
    const ChannelQueue* const first = schedule_.front();
    return first && first->is_held() && controls_.empty() && !small_.waits() &&
           !small_.aborts_wait();
  }

  // When next() has something to hand out that is held back: for the link's rate, or it rests.
  // Whatever else it waits for (something to send, an acknowledgement) comes as an input.
  [[nodiscard]] std::optional<TimePoint> deadline() const {
    auto first = earliest(held_until_, schedule_.wakes_at());
    for (const auto* queue : apart_)
      if (queue->settles_at() != TimePoint::max()) first = earliest(first, queue->settles_at());
    return first;
  }
  void on_time(const Now& now) {
    settle(now);
    if (held_until_ && *held_until_ <= now.steady) held_until_.reset();
    schedule_.wake(now.steady);
  }

  // The peer acknowledges what it has received in total. Returns the tracked messages that it has
  // by that, in the order sent. Nullopt: it is more than was sent (kIllegal).
  struct Delivered {
    ChannelId channel;
    Subject subject;
  };
  [[nodiscard]] std::optional<std::vector<Delivered>> acknowledge(const Arrival& ack,
                                                                  const Now& now);

  [[nodiscard]] ChannelCounts counts(ChannelId channel) const;  // all zero: there is none
  // Bytes of bodies that wait or are partly sent; never more than data_bytes_max. Channels with
  // `keep` do not count: their owner limits them.
  [[nodiscard]] std::uint64_t data_bytes() const { return data_bytes_; }
  [[nodiscard]] std::uint64_t kept_bytes() const { return kept_bytes_; }
  [[nodiscard]] std::uint64_t unacknowledged_bytes() const { return sent_bytes_ - received_bytes_; }
  // To be called before channels are added. Waiting data and the bases count in this budget too;
  // when it is used up, data is dropped as at data_bytes_max. It outlives this.
  void draw_from(Budget& memory) {
    bases_ = std::make_unique<Budget>(&memory);
    held_ = memory.hold(0);
  }
  [[nodiscard]] const Pacer& pacer() const { return pacer_; }
  // Estimated bytes per second that path and cap let pass; 0: not known.
  [[nodiscard]] double assumed_rate() const { return cap_.within(pacer_.assumed_rate()); }
  // In place of OutboxOptions::bytes_per_second_max; 0: no limit.
  [[nodiscard]] double cap() const { return cap_.rate(); }
  void set_cap(double bytes_per_second, const Now& now) {
    cap_.set_rate(bytes_per_second, now.steady);
  }
  // Bytes of IP packets that were sent since the last call (LinkCap).
  std::uint64_t take_sent() { return cap_.take_sent(); }
  // Something waits, and a higher cap would let it leave now.
  [[nodiscard]] bool waits_for_cap(const Now& now) const {
    return !schedule_.empty() && cap_.holds(now.steady);
  }
  // A packet has arrived: its acknowledgements count against the cap.
  void on_received(std::size_t bytes, const Now& now) { cap_.received(bytes, now.steady); }

 private:
  Packet next_control(const Now& now);
  // Several texts in one frame; none if they are short, or do not shrink.
  std::optional<Packet> next_compressed(const Now& now);
  ControlText take_control();
  // May data of this queue leave before the texts that wait?
  [[nodiscard]] bool passes_texts(const ChannelQueue& queue) const;
  [[nodiscard]] bool more_waits() const {
    return !schedule_.empty() || !controls_.empty() || small_.waits() || small_.aborts_wait();
  }
  [[nodiscard]] std::uint64_t held_bytes() const {
    return data_bytes_ + control_bytes_ + resend_bytes_ + texts_.size();
  }
  // A small message of a channel without a configured priority leaves right after the urgent ones,
  // as long as such messages use little of the link's rate; otherwise all that waits on the channel
  // is sent with its class.
  void judge_weight(ChannelQueue& queue, std::size_t body_bytes, const Now& now);
  bool add_data(const Now& now);  // whether it added any
  // Whether this data may leave now; otherwise sets held_until_, if the time is known.
  bool may_leave(const ChannelQueue& queue, std::size_t packet_bytes, const Now& now);
  void take_part(ChannelQueue& queue, std::uint32_t part_max, const Now& now);
  // The queue on turn, without what is too old; null when all are empty.
  ChannelQueue* next_queue(const Now& now);
  // Whether the window lets a packet of this size with data of this class go.
  [[nodiscard]] bool window_allows(const ChannelQueue& queue, std::size_t packet_bytes) const;
  // Makes room for the message that was just pushed with this priority.
  void keep_data_budget(Priority newest);
  [[nodiscard]] bool is_over();
  // Drops the oldest waiting message, else an open one; false when the class has none.
  bool drop_one_of(Priority priority);
  [[nodiscard]] std::uint64_t& bytes_of(const ChannelQueue& queue) {
    return queue.keeps() ? kept_bytes_ : data_bytes_;
  }
  [[nodiscard]] bool must_settle() const { return together_->changed() && !apart_.empty(); }
  // Lets leave what waited for a large message.
  void settle(const Now& now);
  // Runs a change of one queue and keeps the sums of bytes and the schedule right.
  template <class Change>
  void change(ChannelQueue& queue, Change&& change);

  OutboxOptions options_;
  std::unique_ptr<Budget> bases_ = std::make_unique<Budget>();  // of all channels; does not move
  std::unique_ptr<Together> together_ = std::make_unique<Together>();
  std::unordered_map<ChannelId, ChannelQueue> queues_;
  std::deque<ChannelQueue*> apart_;  // those in which something waits for a large message
  ClassSchedule schedule_;
  Budget::Hold held_;  // data and control texts, as of the last push or packet
  std::uint64_t data_bytes_ = 0;
  std::uint64_t kept_bytes_ = 0;  // of channels that keep
  std::uint64_t arrivals_ = 0;

  std::deque<ControlText> controls_;  // that wait
  std::uint64_t texts_pushed_ = 0;
  std::uint64_t texts_left_ = 0;
  TextHistory texts_;
  bool refers_to_kept_ = false;  // the next frame of texts says so
  bool data_first_ = true;       // where texts wait, too: they take turns
  std::uint64_t control_bytes_ = 0;
  SmallFrames small_;
  bool small_first_ = true;  // where texts wait, too: they take turns

  std::uint64_t sent_bytes_ = 0;      // binary packets
  std::uint64_t received_bytes_ = 0;  // by the peer, of these
  std::uint64_t asked_end_ = 0;       // sent_bytes_ behind the last one that asks for an ack
  std::uint64_t kept_since_ask_ = 0;  // resend_bytes() that came since then
  InFlight in_flight_;                // tracked messages, and those that resume
  std::uint64_t resend_bytes_ = 0;    // of all channels
  std::vector<ChannelId> left_;       // take_left()
  Pacer pacer_;
  LinkCap cap_;
  LightBudget light_;
  std::optional<TimePoint> held_until_;  // what waits may leave then
  PacketBuilder packet_;                 // empty between calls
};

}  // namespace connect_bridge
