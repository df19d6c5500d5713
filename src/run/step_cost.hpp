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
    processor_ = read(CLOCK_THREAD_CPUTIME_ID);
    waits_ = waits();
  }
  // What our own code took since the last call.
  Duration own() { return computed(passed()); }
  // What the middleware took since the last call.
  Duration inside() {
    const Duration wall = passed();
    return wall < kShort || waits() != waits_ ? wall : computed(wall);
  }

  // As of the last call.
  [[nodiscard]] TimePoint now() const { return TimePoint(Duration(wall_)); }

 private:
  static constexpr Duration kShort = std::chrono::microseconds(100);

  // Wall time since the last call.
  Duration passed() {
    const std::int64_t now = read(CLOCK_MONOTONIC);
    return Duration(now - std::exchange(wall_, now));
  }
  // To ask for the processor time costs more than a short step takes.
  [[nodiscard]] Duration computed(Duration wall) const {
    return wall < kShort ? wall
                         : std::min(wall, Duration(read(CLOCK_THREAD_CPUTIME_ID) - processor_));
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
  std::int64_t processor_ = 0;  // as of begin()
  long waits_ = 0;              // the same
};

}  // namespace connect_bridge
