// The pauses between readings of the graph.
#pragma once

#include <algorithm>
#include <chrono>

#include "core/base/time.hpp"

namespace connect_bridge::ros {

// A changing graph is read for at most a tenth of the time, and for a quarter of it while readings
// are requested. Arrivals take several steps, such as a node and its endpoints, so after a rest a
// few readings may follow at once. Single-threaded.
class ReadingPace {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  // Factors of the duration of a reading.
  static constexpr int kRest = 9;
  static constexpr int kRestIfAsked = 3;
  static constexpr int kAtOnce = 3;

  struct Rest {
    Duration usual{};
    Duration if_asked{};  // while a reading is requested; never longer
  };
  // A reading of duration `took` has ended. No rest is longer than kRest times `took`, however many
  // readings were requested before.
  [[nodiscard]] Rest after(Duration took, TimePoint now) {
    rested_ = std::max(rested_, now) + took * kRest;
    rested_ = std::min<TimePoint>(rested_, now + took * kRest * (kAtOnce + 1));
    const Duration owed = rested_ - now - took * kRest * kAtOnce;
    const Duration usual = std::max(owed, Duration::zero());
    return {usual, std::min<Duration>(usual, took * kRestIfAsked)};
  }

 private:
  TimePoint rested_{};  // end of the rests that all readings so far require
};

}  // namespace connect_bridge::ros
