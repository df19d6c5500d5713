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
  void add(Duration cost, TimePoint now) {
    used_ = used_ * std::exp2(seconds(at_) - seconds(now)) + static_cast<double>(cost.count());
    at_ = now;
  }
  // Who has used less at the same time has the smaller one. It grows with what is added, and stays
  // as it is while time passes.
  [[nodiscard]] double rank() const { return std::log2(used_) + seconds(at_); }

 private:
  static double seconds(TimePoint at) {
    return std::chrono::duration<double>(at.time_since_epoch()).count();
  }

  double used_ = 0;  // as of `at_`
  TimePoint at_{};
};

// Who pays for what a step costs. Null: nobody.
using Payer = std::shared_ptr<LoopTime>;

}  // namespace connect_bridge
