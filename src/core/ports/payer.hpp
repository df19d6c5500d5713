// The owner of the loop's time.
#pragma once

#include <cmath>
#include <memory>

#include "core/base/time.hpp"

namespace connect_bridge {

// Loop time that one identity has used lately: half of it is forgotten in a second. Only a
// comparison with other identities has a meaning.
class LoopTime {
 public:
  void add(Duration cost, TimePoint now) {
    used_ = used_ * std::exp2(seconds(at_) - seconds(now)) + static_cast<double>(cost.count());
    at_ = now;
  }
  // The identity that has used less at the same time has the smaller rank. The rank grows with
  // added time, and stays while time passes.
  [[nodiscard]] double rank() const { return std::log2(used_) + seconds(at_); }

 private:
  static double seconds(TimePoint at) {
    return std::chrono::duration<double>(at.time_since_epoch()).count();
  }

  double used_ = 0;  // as of `at_`
  TimePoint at_{};
};

// The identity that pays for the cost of a step. Null: nobody.
using Payer = std::shared_ptr<LoopTime>;

}  // namespace connect_bridge
