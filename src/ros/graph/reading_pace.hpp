// How long the graph is not read after a reading.
#pragma once

#include <algorithm>
#include <chrono>

#include "core/base/time.hpp"

namespace connect_bridge::ros {

// A graph that keeps changing is read for a tenth of the time at most, and for a quarter while
// readings are asked for. What comes to a graph comes in several steps, such as a node with its
// endpoints: so after a rest some readings come at once. Single-threaded.
class ReadingPace {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  // In times the duration of a reading.
  static constexpr int kRest = 9;
  static constexpr int kRestIfAsked = 3;
  static constexpr int kAtOnce = 3;

  struct Rest {
    Duration usual{};
    Duration if_asked{};  // not longer
  };
  // A reading that took so long has ended. No rest is longer than kRest of it, however many were
  // asked for before.
  [[nodiscard]] Rest after(Duration took, TimePoint now) {
    rested_ = std::max(rested_, now) + took * kRest;
    rested_ = std::min<TimePoint>(rested_, now + took * kRest * (kAtOnce + 1));
    const Duration owed = rested_ - now - took * kRest * kAtOnce;
    const Duration usual = std::max(owed, Duration::zero());
    return {usual, std::min<Duration>(usual, took * kRestIfAsked)};
  }

 private:
  TimePoint rested_{};  // when there has been a rest for all readings so far
};

}  // namespace connect_bridge::ros
