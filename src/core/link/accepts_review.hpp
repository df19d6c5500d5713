// Compares this side's interfaces with what peers accept, a little at a time.
#pragma once

#include <optional>
#include <vector>

#include "core/base/timers.hpp"
#include "core/flow/rate_limit.hpp"
#include "core/link/link.hpp"

namespace connect_bridge {

// Links take turns. Their peers' lists may be as long as a message allows: about a tenth of the
// loop's time goes into comparing, and some milliseconds at a time. Single-threaded; owned by the
// side.
class AcceptsReview {
 public:
  // In bytes that are looked at (PeerAccepts::kSmall). To compare a name with 4,096 patterns of 250
  // bytes took 2 ms on a busy machine; with a star in each 9 ms, and 30 ms if it was as long.
  static constexpr double kPerSecond = 12.5e6;
  static constexpr Duration kAtOnce = std::chrono::milliseconds(80);
  static constexpr Duration kPeriod = std::chrono::milliseconds(40);
  // Of each link's turn.
  static constexpr double kTurn = 250e3;
  // After a link was done. All interfaces are looked at again for it, so answers come together.
  static constexpr Duration kPause = std::chrono::milliseconds(250);

  // Goes on, if it is time to. The links of which nothing is left to compare since then: what their
  // peers take is to be offered.
  [[nodiscard]] std::vector<Link*> take_done(LinkTable& links, const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline(const LinkTable& links) const;

 private:
  [[nodiscard]] Link* in_turn(LinkTable& links, const Now& now) const;
  void compare(LinkAccepts& accepts, const Now& now);

  Throttle pace_{kPerSecond, kAtOnce};
  TimePoint due_{};  // not before
  LinkId last_;      // whose turn was the last
};

}  // namespace connect_bridge
