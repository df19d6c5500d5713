// Base of all entities that take turns: one entity of ours in the ROS graph, for which the
// middleware reports events.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "ros/entities/ready_list.hpp"

namespace connect_bridge::ros {

// Registered in the ready list as long as it lives. A class that sets callbacks with slot() removes
// them in its own destructor, before the slot can be given to another entity. Thread: the loop's.
class Entity {
 public:
  // `own`: the bits that step() handles, as ReadyBits.
  Entity(ReadyList& ready, std::uint32_t own) : slot_(ready.acquire(this, own)) {}
  virtual ~Entity() { slot_->list->release(slot_); }
  Entity(const Entity&) = delete;
  Entity& operator=(const Entity&) = delete;

  // Handles one ready item, counts its bytes, and calls done() when no more items of its kind are
  // left. Returns an input for the core, if there is one.
  virtual std::optional<Input> step(Batch& batch) = 0;
  // The topic or service of this endpoint.
  [[nodiscard]] const std::string& name() const { return name_; }
  void set_name(const std::string& name) { name_ = name; }
  // How long the entity stays in the graph after its end, for what it has sent last.
  [[nodiscard]] virtual Duration farewell() const { return Duration::zero(); }
  // The entity gets no turn from now on.
  void mute() { slot_->own = slot_->to_do = 0; }

 protected:
  [[nodiscard]] ReadyList::Slot* slot() const { return slot_; }
  [[nodiscard]] bool has_to(std::uint32_t bits) const { return (slot_->to_do & bits) != 0; }
  void done(std::uint32_t bits) { slot_->to_do &= ~bits; }
  void do_also(std::uint32_t bits) { slot_->to_do |= bits; }
  // For on_counted(): one arrival is taken next. True if callbacks reported more than that one: a
  // take that finds nothing then does not mean that nothing is left.
  bool expects_more() {
    slot_->expected += slot_->counted.exchange(0);
    return slot_->expected > 0 && --slot_->expected > 0;
  }

 private:
  ReadyList::Slot* const slot_;
  std::string name_;
};

}  // namespace connect_bridge::ros
