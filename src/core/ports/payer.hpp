// Whose the loop's time is.
#pragma once

#include <cmath>
#include <memory>

#include "core/base/time.hpp"

namespace connect_bridge {

// What one identity has used of the loop's time lately: half of it is forgotten in a second. To be
// compared with that of others.
class LoopTime {
 public:
  [[nodiscard]] double used(TimePoint now) const {
    const std::chrono::duration<double> since = now - at_;
    return used_ * std::exp2(-since.count());
  }
  void add(Duration cost, TimePoint now) {
    used_ = used(now) + static_cast<double>(cost.count());
    at_ = now;
  }

 private:
  double used_ = 0;  // as of `at_`
  TimePoint at_{};
};

// Who pays for what a step costs. Null: nobody.
using Payer = std::shared_ptr<LoopTime>;

}  // namespace connect_bridge
