#include "ros/topics/time_source.hpp"

#include <rcl/time.h>

#include "core/base/qos.hpp"
#include "ros/rcl/qos.hpp"
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

void TimeSource::set(bool on) {
  if (on == (clock_ != nullptr)) return;
  if (!on) {
    clock_.reset();
    ignore_error(rcl_disable_ros_time_override(node_.clock()));
    return;
  }
  const auto type = types_.message("rosgraph_msgs/msg/Clock", "");
  if (const auto* refusal = std::get_if<TypeRefusal>(&type)) {
    node_.log(LogLevel::kError, "use_sim_time has no effect: " + refusal->reason);
    return;
  }
  Qos qos;
  qos.reliability = Reliability::kBestEffort;
  qos.depth = 1;
  // Our own mirror of the peer's /clock counts, too.
  Subscription::Setup setup{"/clock", std::get<0>(type), to_rmw(qos), false};
  clock_ = std::make_unique<Subscription>(node_, SubscriptionId{}, std::move(setup), slot_);
  if (const auto problem = clock_->open()) {
    node_.log(LogLevel::kError, "use_sim_time has no effect: " + *problem);
    clock_.reset();
    return;
  }
  // Until the first sample ROS time is 0, as in every ROS node.
  ignore_error(rcl_set_ros_time_override(node_.clock(), 0));
  ignore_error(rcl_enable_ros_time_override(node_.clock()));
}

void TimeSource::drain() {
  if (!clock_) return;
  MessageTaken message;
  std::optional<Stamp> newest;
  // Depth 1, so this ends; the bound is for a middleware that returns invalid samples without end.
  for (int i = 0; i < 16; ++i) {
    const auto taken = clock_->take(buffer_, message);
    if (taken == Subscription::Taken::kNothing) break;
    if (taken != Subscription::Taken::kSample) continue;
    if (const auto stamp = parse_clock(message.payload.view())) newest = stamp;
  }
  if (newest) ignore_error(rcl_set_ros_time_override(node_.clock(), *newest));
}

}  // namespace connect_bridge::ros
