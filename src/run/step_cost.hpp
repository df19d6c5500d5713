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
// counts if the thread waited there, because the request may hold up a lock of another thread.
// Where nobody else uses the loop, wall time will do: no cost is compared, and the kernel is not
// asked. Runs on the loop's thread.
class StepCost {
 public:
  // A part begins. `alone`: nobody else uses the loop.
  void begin(bool alone) {
    alone_ = alone;
    wall_ = read(CLOCK_MONOTONIC);
    taken_ = Duration::zero();
    if (looked_long_ago()) look();
  }
  // Cost of our own code since the last call.
  Duration own() { return part(false); }
  // Nobody pays for the time since the last call.
  void skip() { static_cast<void>(part(false)); }
  // A part in the middleware begins, right after another part.
  void enter() {
    if (alone_ || Duration(wall_ - waits_at_) < kShort) return;
    waits_at_ = wall_;
    waits_ = waits();
  }
  // Cost of the middleware since the last call.
  Duration inside() { return part(true); }

  // The time of the last call.
  [[nodiscard]] TimePoint now() const { return TimePoint(Duration(wall_)); }
  // Time since begin() that others took from the process.
  [[nodiscard]] Duration taken() const { return taken_; }

 private:
  // Reading the processor time takes longer than a short part. So it is done at most once in this
  // time, and a part pays at most so much for earlier parts. The same applies to the waits.
  static constexpr Duration kShort = std::chrono::microseconds(100);

  Duration part(bool waits_count) {
    const std::int64_t now = read(CLOCK_MONOTONIC);
    const Duration wall(now - std::exchange(wall_, now));
    if (!looked_long_ago()) return wall;
    const Duration computed = look();
    if (wall < kShort || computed >= wall || (waits_count && has_waited())) return wall;
    taken_ += wall - computed;
    return computed;
  }
  [[nodiscard]] bool looked_long_ago() const {
    return !alone_ && Duration(wall_ - looked_at_) >= kShort;
  }
  // Processor time of this thread since the last look.
  Duration look() {
    looked_at_ = wall_;
    const std::int64_t now = read(CLOCK_THREAD_CPUTIME_ID);
    return Duration(now - std::exchange(processor_, now));
  }
  // Whether this thread gave up the processor since the last call, or since enter().
  bool has_waited() {
    waits_at_ = wall_;
    const long now = waits();
    return now != std::exchange(waits_, now);
  }
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

  bool alone_ = false;
  std::int64_t wall_ = 0;
  Duration taken_{};
  // Values of the last look:
  std::int64_t looked_at_ = 0;
  std::int64_t processor_ = 0;
  std::int64_t waits_at_ = 0;
  long waits_ = 0;
};

}  // namespace connect_bridge
