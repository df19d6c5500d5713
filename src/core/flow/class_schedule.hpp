// Chooses the channel that sends its next part: urgent first, then light messages, then the other
// classes by weight. In a class, the message goes first that would be complete first if all
// channels shared equally.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>

#include "core/base/priority.hpp"
#include "core/base/time.hpp"
#include "core/flow/channel_queue.hpp"

namespace connect_bridge {

// High, normal and bulk share by weight 8 : 4 : 1 in bytes, by start-time fair queueing: each class
// has a clock that runs 1, 2 or 8 per byte sent, and the one that is behind goes next. It shares as
// deficit round robin does, but without the burst of a whole quantum, which for the high class
// would have to be eight of the bulk class's largest fragments. The clock of a class that was idle
// is set to the present: it gets nothing extra for the time in which it had nothing to send.
//
// In a class each channel has a clock that runs 1 per byte sent. The one whose clock would be first
// at the end of its next message goes next, and keeps its turn until another one would be earlier.
// So equal messages leave one after the other: the first arrives when it could, and the last no
// later than if they had taken turns part by part. A small one overtakes a large one, and each
// channel has its share of bytes. Of a large message at most `turn_bytes` count at a time: no
// channel waits longer than that for the turns of each other one.
class ClassSchedule {
 public:
  static constexpr std::uint64_t kTurnBytesMost = 512 << 10;

  // The queue has something to send, now or when it has rested. Does nothing if it is in already.
  void add(ChannelQueue& queue);
  // The queue has nothing to send any more, or goes away.
  void remove(ChannelQueue& queue);
  // Removes the queue before its class changes: bytes sent in one class do not count in another.
  void leave_class(ChannelQueue& queue);

  [[nodiscard]] bool empty() const { return front() == nullptr; }
  // The queue whose turn it is; null when there is none.
  [[nodiscard]] ChannelQueue* front() const;
  // The front queue has sent so many bytes, and has more. If it rests now it has no turn until
  // wake().
  void sent(std::size_t bytes);
  // The front queue has nothing more to send. 0 bytes: it had nothing to send.
  void sent_all(std::size_t bytes);

  // Longest turn of one message, in bytes; also applies to a message that is partly sent.
  void set_turn_bytes(std::uint64_t bytes) { turn_bytes_ = bytes; }

  // Queues that have rested until now get their turns.
  void wake(TimePoint now);
  // When the first of them will have.
  [[nodiscard]] std::optional<TimePoint> wakes_at() const;

  // All queues of a class in order of their turns, but the light and the resting ones; and these,
  // of any class.
  [[nodiscard]] const std::deque<ChannelQueue*>& queues(Priority priority) const;
  [[nodiscard]] const std::deque<ChannelQueue*>& light() const;
  [[nodiscard]] const std::deque<ChannelQueue*>& resting() const { return resting_; }

 private:
  struct Class {
    std::deque<ChannelQueue*> turns;  // in order of the ends of their turns
    std::uint64_t clock = 0;
    std::uint64_t begin = 0;  // the latest begin of a turn in which something was sent
  };
  // Index of the class on turn, the number of classes when there is none.
  [[nodiscard]] std::size_t next_class() const;
  // A channel that comes gets nothing extra for the time in which it had nothing to send.
  void add_turn(ChannelQueue& queue);
  void begin_turn(Class& in, ChannelQueue& queue) const;
  // The class on turn, charged for what its front queue sent.
  Class& charge(std::size_t bytes);

  // Urgent, light, then the classes that share.
  std::array<Class, kPriorities + 1> classes_;
  std::deque<ChannelQueue*> resting_;
  std::uint64_t present_ = 0;  // clock of the class that sent last, when it was chosen
  std::uint64_t turn_bytes_ = kTurnBytesMost;
};

}  // namespace connect_bridge
