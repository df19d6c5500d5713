#include "core/flow/class_schedule.hpp"

#include <algorithm>

#include "core/base/check.hpp"
#include "core/base/timers.hpp"

namespace connect_bridge {
namespace {

// Clock ticks per byte: the inverse of the weights 8 : 4 : 1. Urgent and light are strict and have
// no clock.
constexpr std::array<std::uint64_t, kPriorities + 1> kTicksPerByte = {0, 0, 1, 2, 8};
constexpr std::size_t kLight = 1;   // mutant: light_strict
constexpr std::size_t kStrict = 2;  // number of classes before those that share
// With more channels the clock of a class is precise enough: the clock lags by one channel's turn.
constexpr std::size_t kComparedMost = 64;

std::size_t index_of(Priority priority) {
  return priority == Priority::kUrgent ? 0 : static_cast<std::size_t>(priority) + 1;
}

std::size_t index_of(const ChannelQueue& queue) {
  return queue.is_light() ? kLight : index_of(queue.priority());
}

}  // namespace

void ClassSchedule::add(ChannelQueue& queue) {
  if (queue.turn_.scheduled) return;
  queue.turn_.scheduled = true;
  if (queue.rests_until()) {
    resting_.push_back(&queue);
  } else {
    add_turn(queue);
  }
}

void ClassSchedule::add_turn(ChannelQueue& queue) {
  auto& in = classes_[index_of(queue)];
  // A class that was idle gets nothing for that time: it would hold back the others until it has
  // caught up.
  if (in.turns.empty()) in.clock = std::max(in.clock, present_);
  std::uint64_t& clock = queue.turn_.clock;
  // The same of a channel: its clock begins no earlier than the latest turn, nor than the channel
  // that has had least. One that comes again and again keeps its later clock: it pays for what it
  // had.
  clock = std::max(clock, in.begin);
  if (in.turns.size() > kComparedMost) return begin_turn(in, queue);
  const auto is_behind = [](const ChannelQueue* one, const ChannelQueue* other) {
    return one->turn_.clock < other->turn_.clock;
  };
  const auto last = std::min_element(in.turns.begin(), in.turns.end(), is_behind);
  if (last != in.turns.end()) clock = std::max(clock, (*last)->turn_.clock);
  begin_turn(in, queue);
}

void ClassSchedule::begin_turn(Class& in, ChannelQueue& queue) const {
  Turn& turn = queue.turn_;
  turn.begin = turn.clock;
  turn.end = turn.clock + std::min(queue.next_message_bytes(), turn_bytes_);
  const auto is_earlier = [](const ChannelQueue* one, const ChannelQueue* other) {
    return one->turn_.end < other->turn_.end;  // mutant: small_overtakes
  };
  in.turns.insert(std::upper_bound(in.turns.begin(), in.turns.end(), &queue, is_earlier), &queue);
}

void ClassSchedule::remove(ChannelQueue& queue) {
  if (!queue.turn_.scheduled) return;
  // The queue keeps its clock: bytes that it has sent count when it comes again.
  queue.turn_.scheduled = false;
  std::erase(classes_[index_of(queue)].turns, &queue);
  std::erase(resting_, &queue);
}

void ClassSchedule::leave_class(ChannelQueue& queue) {
  remove(queue);
  queue.turn_.clock = 0;
}

void ClassSchedule::wake(TimePoint now) {
  for (auto at = resting_.begin(); at != resting_.end();) {
    if (*(*at)->rests_until() > now) {
      ++at;
      continue;
    }
    add_turn(**at);
    at = resting_.erase(at);
  }
}

std::optional<TimePoint> ClassSchedule::wakes_at() const {
  std::optional<TimePoint> first;
  for (const auto* queue : resting_) first = earliest(first, queue->rests_until());
  return first;
}

const std::deque<ChannelQueue*>& ClassSchedule::queues(Priority priority) const {
  return classes_[index_of(priority)].turns;
}

const std::deque<ChannelQueue*>& ClassSchedule::light() const {
  return classes_[kLight].turns;
}

// Start-time fair queueing, as class_schedule.hpp describes it: of the classes that share, the one
// whose clock is behind goes next. `present_` is the clock at which the last part began, from which
// a class that was idle starts (add_turn).
std::size_t ClassSchedule::next_class() const {
  for (std::size_t i = 0; i < kStrict; ++i)  // mutant: light_first
    if (!classes_[i].turns.empty()) return i;
  std::size_t best = classes_.size();
  for (std::size_t i = kStrict; i < classes_.size(); ++i) {
    if (classes_[i].turns.empty()) continue;
    if (best == classes_.size() || classes_[i].clock < classes_[best].clock) best = i;
  }
  return best;
}

ChannelQueue* ClassSchedule::front() const {
  const auto i = next_class();
  return i == classes_.size() ? nullptr : classes_[i].turns.front();
}

ClassSchedule::Class& ClassSchedule::charge(std::size_t bytes) {
  const auto i = next_class();
  CONNECT_CHECK(i < classes_.size());
  auto& from = classes_[i];
  // 0 bytes: nothing was sent, because all messages were too old. The clock of the class stays.
  if (i >= kStrict && bytes > 0) {
    present_ = from.clock;
    from.clock += bytes * kTicksPerByte[i];
  }
  ChannelQueue& queue = *from.turns.front();
  from.begin = std::max(from.begin, queue.turn_.begin);
  queue.turn_.clock += bytes;
  return from;
}

void ClassSchedule::sent(std::size_t bytes) {
  auto& from = charge(bytes);
  ChannelQueue& queue = *from.turns.front();
  // In the middle of a message it keeps its turn, up to what counts at a time.
  if (queue.is_open() && queue.turn_.clock - queue.turn_.begin < turn_bytes_)
    return;  // mutant: large_turn
  from.turns.pop_front();
  if (queue.rests_until()) {
    resting_.push_back(&queue);
  } else {
    begin_turn(from, queue);
  }
}

void ClassSchedule::sent_all(std::size_t bytes) {
  auto& turns = charge(bytes).turns;
  turns.front()->turn_.scheduled = false;
  turns.pop_front();
}

}  // namespace connect_bridge
