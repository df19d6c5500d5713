// The time when a local topic may be subscribed.
#pragma once

#include <chrono>
#include <optional>

#include "core/base/pace.hpp"

namespace connect_bridge {

// A new subscription takes the middleware some 0.3 ms, while everything else waits. A peer may
// demand hundreds of topics at once, and may switch its demand on and off at will. Single-threaded.
class SubscriptionTurn {
 public:
  // Takes a turn; `all`: the pace of all topics together. Result `now`: the subscription counts as
  // made. A later time: the caller asks again then.
  [[nodiscard]] TimePoint take(Pace& all, TimePoint now) {
    if (own_.free_at() > now) return own_.free_at();
    if (!turn_ || now - *turn_ > kLapses) turn_ = all.reserve(now);
    if (*turn_ > now) return *turn_;
    turn_.reset();
    static_cast<void>(own_.take(now));
    return now;
  }

 private:
  // An unused turn expires: else one topic could collect many turns and use them at once.
  static constexpr Duration kLapses = std::chrono::milliseconds(20);

  Pace own_{10, std::chrono::seconds(1)};
  std::optional<TimePoint> turn_;  // reserved
};

}  // namespace connect_bridge
