// Lets the node's clock follow /clock while use_sim_time is on, or the core asks for it.
#pragma once

#include <memory>
#include <optional>

#include "ros/topics/subscription.hpp"

namespace connect_bridge::ros {

// The time in a serialized rosgraph_msgs/msg/Clock; nullopt: not valid.
std::optional<Stamp> parse_clock(ByteView bytes);

// Thread: the loop's.
class TimeSource {
 public:
  explicit TimeSource(Shared& shared) : shared_(shared) {}

  void set(bool use_sim_time) {
    use_sim_time_ = use_sim_time;
    update();
  }
  void follow(bool asked) {
    asked_ = asked;
    update();
  }

 private:
  void update();

  Shared& shared_;
  bool use_sim_time_ = false;
  bool asked_ = false;
  std::unique_ptr<Subscription> clock_;
};

}  // namespace connect_bridge::ros
