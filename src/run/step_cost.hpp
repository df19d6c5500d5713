// What parts of a step take of the loop.
#pragma once

#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <ctime>
#include <utility>

#include "core/base/time.hpp"

namespace connect_bridge {

// Wall time, but of our own code at most the processor time of this thread: on a busy machine it
// costs nobody what others take from the process. Inside the middleware wall time counts if the
// thread waited there, since a lock that another thread holds is held up by what was asked of it.
// Thread: that of the loop.
class StepCost {
 public:
  // A part begins.
  void begin() {
    wall_ = read(CLOCK_MONOTONIC);
    if (looked_long_ago()) look();
  }
  // What our own code took since the last call.
  Duration own() { return part(false); }
  // What the middleware took since the last call.
  Duration inside() { return part(true); }

  // As of the last call.
  [[nodiscard]] TimePoint now() const { return TimePoint(Duration(wall_)); }

 private:
  // To ask for the processor time and the waits takes longer than a short part does: that is done
  // once in this time at most, and so much a part may pay for what was before it.
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
  // What this thread has computed since the last look.
  Duration look() {
    looked_at_ = wall_;
    waits_ = waits();
    const std::int64_t now = read(CLOCK_THREAD_CPUTIME_ID);
    return Duration(now - std::exchange(processor_, now));
  }
  // How often this thread gave the processor up.
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
  // As of the last look:
  std::int64_t looked_at_ = 0;
  std::int64_t processor_ = 0;
  long waits_ = 0;
};

}  // namespace connect_bridge
