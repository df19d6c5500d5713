#include "ros/topics/time_source.hpp"

#include <rcl/time.h>

#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {

std::optional<Stamp> parse_clock(ByteView bytes) {
  if (bytes.size() < 12) return std::nullopt;
  const bool little = (bytes[1] & 1) != 0;
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      value |= std::uint32_t{bytes[at + i]} << (8 * (little ? i : 3 - i));
    }
    return value;
  };
  return std::int64_t{static_cast<std::int32_t>(word(4))} * 1000000000 + word(8);
}

namespace {

CreateSubscription clock_topic() {
  CreateSubscription create;
  create.topic = "/clock";
  create.type = "rosgraph_msgs/msg/Clock";
  create.qos.reliability = Reliability::kBestEffort;
  create.qos.depth = 1;
  return create;
}

// Sets the node's clock to the newest sample.
class ClockSubscription final : public Subscription {
 public:
  explicit ClockSubscription(Shared& shared)
      // Our own mirror of the peer's /clock counts, too.
      : Subscription(shared, clock_topic(), false), node_(shared.node) {}

  std::optional<Input> step(Batch&) override {
    MessageTaken message;
    std::optional<Stamp> newest;
    // Depth 1 ends this loop; the bound is for a middleware that returns invalid samples without
    // end.
    for (int i = 0; i < 16; ++i) {
      const auto taken = take(message);
      if (taken == Taken::kNothing) break;
      if (taken != Taken::kSample) continue;
      if (const auto stamp = parse_clock(message.payload.view())) newest = stamp;
    }
    if (newest) ignore_error(rcl_set_ros_time_override(node_.clock(), *newest));
    done(~0U);
    return std::nullopt;
  }

 private:
  Node& node_;
};

}  // namespace

void TimeSource::update() {
  const bool on = use_sim_time_ || asked_;
  if (on == (clock_ != nullptr)) return;
  if (!on) {
    clock_.reset();
    ignore_error(rcl_disable_ros_time_override(shared_.node.clock()));
    return;
  }
  clock_ = std::make_unique<ClockSubscription>(shared_);
  if (const auto refusal = clock_->open()) {
    shared_.node.log(LogLevel::kError, "the time of /clock cannot be followed: " + refusal->reason);
    clock_.reset();
    return;
  }
  // ROS time is 0 until the first sample, as in every ROS node.
  ignore_error(rcl_set_ros_time_override(shared_.node.clock(), 0));
  ignore_error(rcl_enable_ros_time_override(shared_.node.clock()));
}

}  // namespace connect_bridge::ros
