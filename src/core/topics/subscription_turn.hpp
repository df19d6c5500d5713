// When an exported topic may be subscribed.
#pragma once

#include <chrono>
#include <optional>

#include "core/base/pace.hpp"

namespace connect_bridge {

// To make a subscription takes the middleware some 0.3 ms, in which everything else waits. A peer
// may demand hundreds of topics at once, and may switch its demand on and off at will.
// Single-threaded.
class SubscriptionTurn {
 public:
  // `all`: of all topics together. Now: it counts as made. Later: it is to be asked for again then.
  [[nodiscard]] TimePoint take(Pace& all, TimePoint now) {
    if (own_.free_at() > now) return own_.free_at();
    if (!turn_ || now - *turn_ > kLapses) turn_ = all.reserve(now);
    if (*turn_ > now) return *turn_;
    turn_.reset();
    static_cast<void>(own_.take(now));
    return now;
  }

 private:
  // A turn that is not taken is over: else one could collect many, and use them all at once.
  static constexpr Duration kLapses = std::chrono::milliseconds(20);

  Pace own_{10, std::chrono::seconds(1)};
  std::optional<TimePoint> turn_;  // reserved
};

}  // namespace connect_bridge
