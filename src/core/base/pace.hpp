// Limits how often a peer may cause something: some at once, then one per period.
#pragma once

#include <algorithm>

#include "core/base/time.hpp"

namespace connect_bridge {

// A leaky bucket in time: each event costs one period, and at most `at_once` periods may be owed.
// For data rates use flow/rate_limit.hpp.
class Pace {
 public:
  Pace(int at_once, Duration period) : at_once_(at_once), period_(period) {}

  // Counts one more. False: it comes too early and is not counted.
  [[nodiscard]] bool take(TimePoint now) {
    if (free_at() > now) return false;
    paid_until_ = std::max(paid_until_, now) + period_;
    return true;
  }
  // One more happens at the time that is returned: now, or when its turn comes.
  [[nodiscard]] TimePoint reserve(TimePoint now) {
    const TimePoint turn = std::max(now, free_at());
    paid_until_ = std::max(paid_until_, now) + period_;
    return turn;
  }
  // One that was counted did not happen.
  void give_back() { paid_until_ -= period_; }
  [[nodiscard]] Duration period() const { return period_; }
  // All that happened is paid for.
  [[nodiscard]] bool idle(TimePoint now) const { return paid_until_ <= now; }
  // When the next one may happen.
  [[nodiscard]] TimePoint free_at() const { return paid_until_ - (at_once_ - 1) * period_; }

 private:
  int at_once_;
  Duration period_;
  TimePoint paid_until_{};
};

}  // namespace connect_bridge
