// Limits how much small messages may overtake others.
#pragma once

#include <algorithm>
#include <cstddef>

#include "core/base/time.hpp"
#include "core/flow/rate_limit.hpp"

namespace connect_bridge {

// How much all light messages (docs/flow.md, section 4) of a link may use together: a small share
// of its rate. Belongs to one connection.
class LightBudget {
 public:
  [[nodiscard]] bool ready(TimePoint now) const { return bytes_.ready(now); }
  // `rate`: bytes per second that the path carries (0: not known); `cap`: limit in bytes per second
  // (0: none).
  void take(std::size_t bytes, double rate, double cap, TimePoint now) {
    const double share = std::max(rate * kShare, kRateMin);
    bytes_.set_rate(cap > 0 ? std::min(share, cap * kShareOfCap) : share);
    bytes_.take(static_cast<double>(bytes), now);
  }

 private:
  static constexpr double kShare = 0.1;
  static constexpr double kShareOfCap = 0.5;
  static constexpr double kRateMin = 10000;  // bytes per second

  Throttle bytes_{kRateMin, std::chrono::milliseconds(50)};
};

}  // namespace connect_bridge
