// A TCP connection of somebody else that has always more to send, by cubic (RFC 9438, section 4).
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>

#include "core/base/time.hpp"

namespace connect_bridge::flow_test {

class ForeignFlow {
 public:
  static constexpr std::uint32_t kPacketBytes = 1448;

  // How many packets leave now.
  int leaves(Duration now) {
    const double since = seconds(now - lost_at_) - std::cbrt(most_ * 0.3 / 0.4);
    if (lost_at_ > Duration{}) window_ = std::max(2.0, 0.4 * since * since * since + most_);
    const int count = std::max(0, static_cast<int>(window_) - under_way_);
    under_way_ += count;
    return count;
  }

  void acknowledged() {
    --under_way_;
    if (lost_at_ == Duration{}) ++window_;  // slow start
  }

  // `delay`: what packets take now. Of a window several may be lost, and are one loss.
  void lost(Duration now, Duration delay) {
    --under_way_;
    if (now - lost_at_ < delay) return;
    lost_at_ = now;
    most_ = window_;
    window_ *= 0.7;
  }

 private:
  static double seconds(Duration time) { return std::chrono::duration<double>(time).count(); }

  double window_ = 10;
  double most_ = 0;
  int under_way_ = 0;
  Duration lost_at_{};
};

}  // namespace connect_bridge::flow_test
