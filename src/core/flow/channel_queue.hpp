// The messages of one channel that wait to be sent, and the one that is partly sent.
// One unit: each change of a message (queued, begun, sent, replaced, replayed) moves the same byte
// counts, which are exact only where one type makes all changes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <unordered_map>
#include <utility>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/flow/delta_encoder.hpp"
#include "core/flow/out_message.hpp"
#include "core/flow/overload.hpp"
#include "core/flow/packet.hpp"
#include "core/flow/packet_groups.hpp"
#include "core/flow/queue_options.hpp"
#include "core/flow/replay.hpp"
#include "core/flow/together.hpp"

namespace connect_bridge {

// A channel's place in ClassSchedule, in bytes by the channel's clock, which runs with what it
// sends.
struct Turn {
  bool scheduled = false;
  std::uint64_t clock = 0;
  std::uint64_t begin = 0;
  std::uint64_t end = 0;  // as expected when it began
};

// Belongs to an Outbox. Every message pushed ends as sent or dropped under one reason; counts() is
// exact after each call.
class ChannelQueue {
 public:
  // `bases`: of the link (DeltaEncoder); `together` as well.
  ChannelQueue(ChannelId id, const QueueOptions& options, Budget& bases, Together& together);

  // New options for messages pushed from now on; those that wait stay, and so does compression.
  void configure(const QueueOptions& options) { options_ = options; }

  // Queues the message or drops it, and drops what it displaces. `arrival` rises over all channels.
  void push(OutMessage message, std::uint64_t arrival, const Now& now);

  // Lets those leave, or drops them, that wait for a large message (Together) of which more is
  // known now. Only while may_settle().
  void settle(const Now& now);
  [[nodiscard]] bool may_settle() const { return !apart_.empty(); }
  // When one of them will have waited long enough.
  [[nodiscard]] TimePoint settles_at() const { return settles_at_; }

  // Drops what became too old to be started; then whether there is anything to send.
  bool ready(const Now& now);
  // Gives the next message the form in which it leaves on a path that carries `rate` bytes per
  // second (0: not known). Only after ready().
  void prepare(double rate);
  // Frame bytes that the next part takes. Only after prepare().
  [[nodiscard]] std::size_t next_part_bytes(std::uint32_t fragment_bytes) const;
  // A message whose last part was handed out.
  struct Whole {
    Subject subject;
    std::uint32_t sequence = 0;
    bool resumes = false;
    bool tracked = false;
    bool reports_leaving = false;
  };
  // Hands that part out. The message, if this was the last part of one that somebody waits for.
  std::optional<Whole> take_part(std::uint32_t fragment_bytes, PacketBuilder& packet,
                                 const Now& now);

  // Arrival number of the oldest message that is not yet started.
  [[nodiscard]] std::optional<std::uint64_t> oldest_waiting() const {
    if (!waiting_.empty()) return waiting_.front().arrival;
    if (!apart_.empty()) return apart_.front().arrival;
    return std::nullopt;
  }
  void drop_oldest_waiting(DropReason reason);
  void drop_waiting(DropReason reason) {
    while (oldest_waiting()) drop_oldest_waiting(reason);
  }
  // Drops the oldest message of the subject that is not begun (kNoDemand). False: there is none.
  bool take_back(Subject subject) {
    const auto at = std::find_if(waiting_.begin(), waiting_.end(), [&](const Waiting& waiting) {
      return waiting.message.subject == subject;
    });
    if (at == waiting_.end()) return false;
    drop_waiting_at(static_cast<std::size_t>(at - waiting_.begin()), DropReason::kNoDemand);
    return true;
  }
  // Drops the partly sent message; false if there is none. The caller sends `abort`, unless the
  // peer forgets the channel anyway. Its sequence number is used up all the same, and no base has
  // changed: an aborted message counts as one that began and never ended (docs/protocol.md
  // section 6).
  bool drop_open(DropReason reason) {
    if (open_) count_dropped(open_->message, reason);
    return std::exchange(open_, std::nullopt).has_value();
  }

  // On a new connection sequences go on after `last_sequence`.
  void restart(std::uint32_t last_sequence) {
    sequence_ = last_sequence;
    forget_bases();
  }
  [[nodiscard]] std::uint32_t last_sequence() const { return sequence_; }
  // The peer no longer has a base of any origin (or of this one).
  void forget_bases() {
    front_.reset();
    if (deltas_) deltas_->clear();
  }
  // A rate has left out this packet of a video.
  void leave_out(OriginId origin, std::uint64_t order) { groups_.left_out(origin, order); }
  void forget_base(OriginId origin) {
    front_.reset();
    turns_.erase(origin);
    groups_.forget(origin);
    if (deltas_) deltas_->forget(origin);
  }

  // ---- over connections
  // The peer has all of a message that resumes.
  void arrived(std::uint32_t sequence) {
    if (sent_.empty() || sent_.front().message.sequence != sequence) return;
    resend_bytes_ -= kept_bytes_of(sent_.front().message);
    sent_.pop_front();
  }
  // Forgets the sent messages: nobody waits for their arrival any longer.
  void forget_sent() {
    sent_.clear();
    resend_bytes_ = 0;
  }
  // Bytes of messages that were sent and are kept until the peer has them: bodies, and
  // kKeptMessageBytes for each.
  [[nodiscard]] std::uint64_t resend_bytes() const { return resend_bytes_; }
  // The messages that resume and that may not have arrived, in the order of the channel: those that
  // are sent, the one that is partly sent, those that wait. Here they count as never accepted: the
  // next connection's queue counts them, so that each counts once.
  std::deque<OutMessage> take_unarrived();
  // Queues such messages of the connection before, ahead of all, and with them what comes before
  // `until` while some still wait (Replay).
  void go_on(std::deque<OutMessage> messages, std::uint64_t& arrivals, const Now& now,
             TimePoint until);
  // Whether the next part begins a message that is kept until the peer has it.
  [[nodiscard]] bool begins_resuming() const {
    return !open_ && !waiting_.empty() && waiting_.front().message.resumes;
  }
  // Whether such messages wait; and whether they or one that is partly sent need this subject.
  [[nodiscard]] bool goes_on() const { return replay_.count() > 0; }
  [[nodiscard]] bool holds(const Subject& subject) const {
    return goes_on() || (open_ && open_->message.subject == subject);
  }
  // The next of them is held back: there is nothing to send before then.
  [[nodiscard]] std::optional<TimePoint> rests_until() const { return rests_until_; }
  [[nodiscard]] ChannelId id() const { return id_; }
  [[nodiscard]] Priority priority() const { return options_.priority; }
  // Whether the link's rate holds back what waits.
  [[nodiscard]] bool is_held() const { return !light_ && priority() != Priority::kUrgent; }
  // Messages in front of a light message leave with it, so they must be light, too.
  [[nodiscard]] bool may_be_light(std::size_t body_bytes) const {
    return options_.may_be_light && body_bytes <= kLightBytes && !open_ && (light_ || empty());
  }
  [[nodiscard]] bool is_light() const { return light_; }
  // Whether what waits leaves right behind the urgent messages. It must not be scheduled meanwhile.
  void set_light(bool light) { light_ = light; }
  [[nodiscard]] bool keeps() const { return options_.keep; }
  // Its messages leave after this number of control texts of the outbox.
  void follow_texts(std::uint64_t count) { texts_before_ = count; }
  [[nodiscard]] std::uint64_t texts_before() const { return texts_before_; }
  [[nodiscard]] bool empty() const { return !open_ && waiting_.empty(); }
  [[nodiscard]] bool is_open() const { return open_.has_value(); }
  // If depth drops nothing, each message counts kKeptMessageBytes in addition to its body.
  [[nodiscard]] std::uint64_t bytes() const {
    return counts_.queued_bytes + (options_.keep ? counts_.queued * kKeptMessageBytes : 0);
  }
  [[nodiscard]] const ChannelCounts& counts() const { return counts_; }
  // How long the last message that began to leave had waited. Nothing: none has.
  [[nodiscard]] std::optional<Duration> last_wait() const { return last_wait_; }
  [[nodiscard]] const Overload& overload() const { return overload_; }
  // Bytes of the next message, or the rest of the message that is partly sent.
  [[nodiscard]] std::uint64_t next_message_bytes() const {
    if (open_) return open_->message.body.size() - open_->offset;
    return waiting_.empty() ? 0 : waiting_.front().message.body.size();
  }
  // The partly sent message: its body bytes that were handed out, and for how long it is partly
  // sent. nullopt: there is none.
  struct Progress {
    std::uint64_t bytes = 0;
    Duration time{};
  };
  [[nodiscard]] std::optional<Progress> progress(TimePoint now) const {
    if (!open_) return std::nullopt;
    return Progress{open_->offset, now - open_->since};
  }
  // Body bytes that are not handed out yet.
  [[nodiscard]] std::uint64_t left_bytes() const {
    return counts_.queued_bytes - (open_ ? open_->offset : 0);
  }

 private:
  friend class ClassSchedule;
  struct Waiting {
    OutMessage message;
    std::uint64_t arrival = 0;
    TimePoint since{};  // of the place: something has waited in it
    TimePoint came{};   // the message itself, which may have displaced an older one

    void put(OutMessage other, TimePoint at) {
      message = std::move(other);
      came = at;
    }
  };
  struct Open {
    OutMessage message;
    std::uint32_t offset = 0;  // body bytes handed out
    TimePoint since{};
    Payload raw;        // of what was prepared smaller
    Budget::Hold room;  // of that (DeltaEncoder::Body)
  };
  // May not have arrived, and is to be sent again on the next connection.
  struct Sent {
    OutMessage message;     // as it would be sent again
    std::size_t bytes = 0;  // of its body as it left
  };
  // The first of those that wait, prepared.
  struct Front {
    std::optional<DeltaEncoder::Body> smaller;  // none: it leaves as it is
  };

  [[nodiscard]] std::optional<DropReason> too_old(const OutMessage& message, const Now& now) const;
  // How many bytes may ever wait.
  [[nodiscard]] std::uint64_t bytes_max() const {
    return std::max(options_.queue_bytes_max, options_.burst_bytes_max);
  }
  // The reason that keeps the message out of the queue, whatever else waits.
  [[nodiscard]] std::optional<DropReason> refused(const OutMessage& message, const Now& now) const;
  // `gone`: bytes of what would give way.
  [[nodiscard]] bool has_room(std::size_t body_bytes, const Now& now, std::size_t gone = 0) const;
  // Drops what the message displaces where depth limits the channel. Whether it has found its place
  // among those that wait.
  bool make_room(OutMessage& message, std::uint64_t arrival, const Now& now);
  void replace(OutMessage message, std::uint64_t arrival, const Now& now);
  // `first`: of those that it may go before.
  void take_turn(std::size_t first);
  // Without room, the publisher whose turn was last gives way, not the one that waits longest.
  // `first`: the first message that may be dropped.
  void drop_last(std::size_t first, const Now& now) {
    while (options_.depth > 0 && waiting_.size() > first + options_.depth)
      drop_waiting_at(waiting_.size() - 1, DropReason::kQueueDepth);
    while (waiting_.size() > first + 1 && !has_room(0, now))
      drop_waiting_at(waiting_.size() - 1, DropReason::kQueueBytes);
  }
  void drop_overdue(const Now& now);
  // Drops waiting packets of the camera: a new group begins.
  void drop_older_group(const OutMessage& key, const Now& now);
  // Beside messages of others, the oldest of its own publisher gives way, and the rest of these
  // move up. A state without an older one waits for its publisher's turn, and the last message is
  // dropped. So publishers of one topic take turns. False: the oldest of all must give way, or too
  // little room would be left.
  bool displace(OutMessage& message, std::uint64_t arrival, const Now& now);
  // Takes the first of those that wait, in the form in which it leaves.
  Open begin(const Now& now);
  // All of it was handed out.
  std::optional<Whole> end(Open whole, const Now& now);
  void keep_sent(OutMessage message, std::size_t bytes) {
    resend_bytes_ += kept_bytes_of(message);
    sent_.push_back({std::move(message), bytes});
  }
  // The message as it was before it was made smaller.
  static OutMessage unprepared(Open open);
  // Whether it waits for the large message that it follows; if so, settles_at() is no later.
  Together::Verdict judge(const Waiting& next, const Now& now);
  // The first `count` of those that do join what waits. So what came before one that leaves does
  // so, too: the order of the channel stays.
  void rejoin(std::size_t count, const Now& now);
  // Puts a message that is counted where it waits for its turn.
  void place(OutMessage message, std::uint64_t arrival, const Now& now);
  void drop_waiting_at(std::size_t index, DropReason reason) {
    count_dropped(take_waiting(index), reason);
  }
  // Takes the message at `index` out of what waits.
  OutMessage take_waiting(std::size_t index);
  void enqueue(OutMessage message, std::uint64_t arrival, const Now& now) {
    waiting_bytes_ += message.body.size();
    waiting_.push_back({std::move(message), arrival, now.steady, now.steady});
  }
  void count_queued(const OutMessage& message) {
    ++counts_.queued;
    counts_.queued_bytes += message.body.size();
  }
  void count_dropped(const OutMessage& message, DropReason reason) {
    counts_.dropped.add(reason);
    --counts_.queued;
    counts_.queued_bytes -= message.body.size();
    groups_.dropped(message);
    if (message.moment.is_large()) together_.gone(message.moment);
  }

  ChannelId id_;
  QueueOptions options_;
  ChannelCounts counts_;
  std::deque<Waiting> waiting_;
  std::deque<Waiting> apart_;  // that wait for a large message, newer than those
  TimePoint settles_at_ = TimePoint::max();
  std::uint64_t waiting_bytes_ = 0;
  Replay replay_;  // the first of them
  Overload overload_;
  std::unordered_map<OriginId, std::uint64_t> turns_;  // of states: when each had its last
  PacketGroups groups_;
  std::optional<Duration> last_wait_;
  std::optional<TimePoint> rests_until_;
  std::deque<Sent> sent_;  // wholly, that resume; until the peer has them
  std::uint64_t resend_bytes_ = 0;
  std::optional<Open> open_;
  Together& together_;
  std::optional<DeltaEncoder> deltas_;
  std::optional<Front> front_;
  std::uint32_t sequence_ = 0;  // of the last message started
  bool light_ = false;
  std::uint64_t texts_before_ = 0;
  Turn turn_;  // ClassSchedule's
};

}  // namespace connect_bridge
