// TCP's congestion control cubic (RFC 9438), as far as a path in virtual time needs it: a full
// queue marks what would be dropped, and nothing has to be repaired.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge::flow_test {

class Cubic {
 public:
  static constexpr double kSegmentBytes = 1448;

  // Bytes that may be on their way.
  [[nodiscard]] double window() const { return segments_ * kSegmentBytes; }

  // `limited`: the sender had less to send than the window allows.
  void acknowledged(double bytes, bool limited, Duration round_trip, Duration now) {
    if (limited) return;
    if (!cut_at_) {
      segments_ += bytes / kSegmentBytes;
      return;
    }
    const double since = seconds(now - *cut_at_ + round_trip) - std::cbrt(most_ * 0.3 / 0.4);
    const double wanted =
        std::clamp(0.4 * since * since * since + most_, segments_, 1.5 * segments_);
    segments_ += (wanted - segments_) * bytes / window();
  }

  void marked(Duration round_trip, Duration now) {
    if (cut_at_ && now - *cut_at_ < round_trip) return;  // once in a round trip
    cut_at_ = now;
    most_ = segments_;
    segments_ = std::max(0.7 * segments_, 2.0);
  }

 private:
  static double seconds(Duration time) { return std::chrono::duration<double>(time).count(); }

  double segments_ = 10;
  double most_ = 0;
  std::optional<Duration> cut_at_;
};

}  // namespace connect_bridge::flow_test
