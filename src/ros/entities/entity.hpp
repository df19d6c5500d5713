// What takes turns: one thing of ours in the ROS graph about which the middleware has news.
#pragma once

#include <cstdint>
#include <optional>

#include "ros/entities/ready_list.hpp"

namespace connect_bridge::ros {

// Stands in the ready list as long as it lives. A class that sets callbacks with slot() takes them
// back in its own destructor, before the slot can be given to another entity.
// Thread: the loop's.
class Entity {
 public:
  // `own`: what step() does, as ReadyBits.
  Entity(ReadyList& ready, std::uint32_t own) : slot_(ready.acquire(this, own)) {}
  virtual ~Entity() { slot_->list->release(slot_); }
  Entity(const Entity&) = delete;
  Entity& operator=(const Entity&) = delete;

  // Does one of the things that are to do and calls done() when that was all of its kind; counts
  // the bytes that it takes. Returns what the core must know.
  virtual std::optional<Input> step(Batch& batch) = 0;

 protected:
  [[nodiscard]] ReadyList::Slot* slot() const { return slot_; }
  [[nodiscard]] bool has_to(std::uint32_t bits) const { return (slot_->to_do & bits) != 0; }
  void done(std::uint32_t bits) { slot_->to_do &= ~bits; }
  void do_also(std::uint32_t bits) { slot_->to_do |= bits; }
  // For on_counted(): one arrival is about to be taken. Returns whether callbacks told of more than
  // that one: then a take that finds nothing does not mean that nothing is left.
  bool expects_more() {
    slot_->expected += slot_->counted.exchange(0);
    return slot_->expected > 0 && --slot_->expected > 0;
  }

 private:
  ReadyList::Slot* const slot_;
};

}  // namespace connect_bridge::ros
