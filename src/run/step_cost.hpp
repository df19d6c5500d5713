// The loop time that parts of a step cost.
#pragma once

#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <ctime>
#include <utility>

#include "core/base/time.hpp"

namespace connect_bridge {

// Measures wall time, but for our own code at most this thread's processor time: on a busy machine
// no link pays for the time that others take from the process. Inside the middleware wall time
// counts if the thread waited there, because the request may hold up a lock of another thread. Runs
// on the loop's thread.
class StepCost {
 public:
  // A part begins.
  void begin() {
    wall_ = read(CLOCK_MONOTONIC);
    if (looked_long_ago()) look();
  }
  // Cost of our own code since the last call.
  Duration own() { return part(false); }
  // Cost of the middleware since the last call.
  Duration inside() { return part(true); }

  // The time of the last call.
  [[nodiscard]] TimePoint now() const { return TimePoint(Duration(wall_)); }

 private:
  // Reading the processor time and the waits takes longer than a short part. So it is done at most
  // once in this time, and a part pays at most so much for earlier parts.
  static constexpr Duration kShort = std::chrono::microseconds(100);

  Duration part(bool waits_count) {
    const std::int64_t now = read(CLOCK_MONOTONIC);
    const Duration wall(now - std::exchange(wall_, now));
    if (!looked_long_ago()) return wall;
    const long waits_before = waits_;
    const Duration computed = look();
    if (wall < kShort || (waits_count && waits_ != waits_before)) return wall;
    return std::min(wall, computed);
  }
  [[nodiscard]] bool looked_long_ago() const { return Duration(wall_ - looked_at_) >= kShort; }
  // Processor time of this thread since the last look.
  Duration look() {
    looked_at_ = wall_;
    waits_ = waits();
    const std::int64_t now = read(CLOCK_THREAD_CPUTIME_ID);
    return Duration(now - std::exchange(processor_, now));
  }
  // The number of times that this thread gave up the processor.
  static long waits() {
    rusage used{};
    getrusage(RUSAGE_THREAD, &used);
    return used.ru_nvcsw;
  }

  static std::int64_t read(clockid_t id) {
    timespec t{};
    clock_gettime(id, &t);
    return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
  }

  std::int64_t wall_ = 0;
  // Values of the last look:
  std::int64_t looked_at_ = 0;
  std::int64_t processor_ = 0;
  long waits_ = 0;
};

}  // namespace connect_bridge
