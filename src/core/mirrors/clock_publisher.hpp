// Publishes the peer's ROS time as /clock at a set rate (rule key `clock: publish`), corrected by
// the link's delay. So a single tick may be lost. If several bridges of one graph do so, one
// publishes.
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

// Extrapolates between the replies to time requests, at the measured rate of the peer's ROS time: a
// simulation may run at half speed or stand still. The published time never runs backwards, unless
// the peer's time jumps by more than a second (a restarted simulation).
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

  // Adds the entry that stands for /clock in our claim.
  void add_mirrored(Claim& claim) const;

 private:
  struct Sample {
    Stamp local = 0;  // our system clock when the peer's ROS time was `ros`
    Stamp ros = 0;
  };
  [[nodiscard]] Stamp ros_at(Stamp local) const;

  Duration period_;
  MirrorId mirror_;
  Gid claimed_;  // stands for /clock in a claim
  TimePoint next_{};
  std::optional<Sample> sample_;
  double rate_ = 1.0;
  double measured_rate_ = 1.0;  // by the last two replies
  Stamp last_published_ = 0;
};

// Does a peer need the time of our graph, to publish it? The time is that of /clock, if the rules
// let the peer have that topic. Nothing else uses it, so /clock is subscribed only then. Before it
// has a publisher there is no time, and after its publisher time stands still, as for every node
// there. So a simulator that starts later, or again, does not make the peer's time jump to or from
// the time of the system.
[[nodiscard]] bool wants_clock(const LinkTable& links, const Policy& policy);

}  // namespace connect_bridge
