// Lets the node's clock follow /clock while use_sim_time is on.
#pragma once

#include <memory>
#include <optional>

#include "ros/entities/ready_list.hpp"
#include "ros/node/node.hpp"
#include "ros/topics/subscription.hpp"
#include "ros/types/type_supports.hpp"

namespace connect_bridge::ros {

// The time in a serialized rosgraph_msgs/msg/Clock.
std::optional<Stamp> parse_clock(ByteView bytes);

// Thread: the loop's.
class TimeSource {
 public:
  // `slot` is marked when /clock has news; it stays the caller's.
  TimeSource(Node& node, TypeSupports& types, ReadyList::Slot* slot)
      : node_(node), types_(types), slot_(slot) {}

  void set(bool on);
  // Takes what has come, the newest counts.
  void drain();

 private:
  Node& node_;
  TypeSupports& types_;
  ReadyList::Slot* const slot_;
  TakeBuffer buffer_;
  std::unique_ptr<Subscription> clock_;
};

}  // namespace connect_bridge::ros
