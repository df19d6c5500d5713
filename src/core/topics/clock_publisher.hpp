// Publishes the peer's ROS time as /clock at a set rate (rule key `clock: publish`), with the
// link's delay corrected, so that it does not depend on every tick crossing the link. Of several
// bridges in one graph that do so one publishes.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "core/base/bytes.hpp"
#include "core/graph/claims.hpp"
#include "core/graph/options.hpp"
#include "core/link/link.hpp"
#include "core/policy/policy.hpp"
#include "core/ports/outputs.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge {

inline constexpr char kClockType[] = "rosgraph_msgs/msg/Clock";

// Extrapolates between the answers to time requests, at the measured rate of the peer's ROS time (a
// simulation may run at half speed or stand still). Never runs backwards, except for a jump of the
// peer's time by more than a second (a restarted simulation).
class ClockPublisher {
 public:
  explicit ClockPublisher(Duration period) : period_(period) {}

  // The link is alive: creates the mirror of /clock (`topic` is its local name).
  void start(const std::string& topic, Outputs& outputs, const Now& now);
  void stop(Outputs& outputs);
  // `t4`: our system clock at the reply's arrival.
  void on_reply(const TimeReply& reply, Stamp t4);
  void on_time(Outputs& outputs, const Claims& claims, const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  // The entry of our own claim for it.
  void add_mirrored(Claim& claim) const;

 private:
  struct Sample {
    Stamp local = 0;  // our system clock when the peer's ROS time was `ros`
    Stamp ros = 0;
  };
  [[nodiscard]] Stamp ros_at(Stamp local) const;

  Duration period_;
  MirrorId mirror_;
  Gid claimed_;  // what stands for it in a claim
  TimePoint next_{};
  std::optional<Sample> sample_;
  double rate_ = 1.0;
  double measured_rate_ = 1.0;  // by the last two replies
  Stamp last_published_ = 0;
};

// A peer that publishes our ROS time needs the time of our graph: that of /clock, if the rules let
// it have that topic. Nothing else uses it, so /clock is followed only then. Until it has a
// publisher there is no time, and when that ends time stands still, as for every node there: a
// simulator that starts later, or again, must not make the peer's time jump from that of the
// system, or to it.
[[nodiscard]] bool wants_clock(const LinkTable& links, const Policy& policy);

}  // namespace connect_bridge
