#include "core/flow/class_schedule.hpp"

#include <algorithm>

#include "core/base/check.hpp"

namespace connect_bridge {
namespace {

// Clock ticks per byte: the inverse of the weights 8 : 4 : 1. Urgent is strict and has no clock.
constexpr std::array<std::uint64_t, kPriorities> kTicksPerByte = {0, 1, 2, 8};

std::size_t index_of(Priority priority) {
  return static_cast<std::size_t>(priority);
}

}  // namespace

void ClassSchedule::add(ChannelQueue& queue) {
  if (queue.scheduled_) return;
  queue.scheduled_ = true;
  auto& in = classes_[index_of(queue.priority())];
  if (in.turns.empty()) in.clock = std::max(in.clock, present_);
  in.turns.push_back(&queue);
}

void ClassSchedule::remove(ChannelQueue& queue) {
  if (!queue.scheduled_) return;
  queue.scheduled_ = false;
  std::erase(classes_[index_of(queue.priority())].turns, &queue);
}

std::size_t ClassSchedule::next_class() const {
  if (!classes_[0].turns.empty()) return 0;
  std::size_t best = kPriorities;
  for (std::size_t i = 1; i < kPriorities; ++i) {
    if (classes_[i].turns.empty()) continue;
    if (best == kPriorities || classes_[i].clock < classes_[best].clock) best = i;
  }
  return best;
}

ChannelQueue* ClassSchedule::front() const {
  const auto i = next_class();
  return i == kPriorities ? nullptr : classes_[i].turns.front();
}

ClassSchedule::Class& ClassSchedule::charge(std::size_t bytes) {
  const auto i = next_class();
  CONNECT_CHECK(i < kPriorities);
  auto& from = classes_[i];
  if (i > 0 && bytes > 0) {
    present_ = from.clock;
    from.clock += bytes * kTicksPerByte[i];
  }
  return from;
}

void ClassSchedule::sent(std::size_t bytes) {
  auto& turns = charge(bytes).turns;
  if (turns.size() == 1) return;
  turns.push_back(turns.front());
  turns.pop_front();
}

void ClassSchedule::sent_all(std::size_t bytes) {
  auto& turns = charge(bytes).turns;
  turns.front()->scheduled_ = false;
  turns.pop_front();
}

}  // namespace connect_bridge
