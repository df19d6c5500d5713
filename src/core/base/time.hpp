// Time is an argument: the core never reads a clock.
#pragma once

#include <chrono>
#include <cstdint>

namespace connect_bridge {

using Duration = std::chrono::nanoseconds;

// A monotonic time line of the process (or of the simulation). Its zero means nothing.
struct Timeline {
  using rep = Duration::rep;
  using period = Duration::period;
  using duration = Duration;
  using time_point = std::chrono::time_point<Timeline>;
  static constexpr bool is_steady = true;
};
using TimePoint = Timeline::time_point;

// Nanoseconds since 1970-01-01 UTC (system clock) or of a node's ROS time; 0 means "not known".
using Stamp = std::int64_t;
inline constexpr Stamp kStampSecond = 1'000'000'000;

// Whether arithmetic on a stamp from a peer cannot overflow (up to the year 2116).
constexpr bool is_plausible(Stamp stamp) {
  return stamp > 0 && stamp < (Stamp{1} << 62);
}

// The time of one input, as the three clocks of this process show it.
struct Now {
  TimePoint steady{};
  Stamp system = 0;
  Stamp ros = 0;
};

inline constexpr Duration kForever = Duration::max();

}  // namespace connect_bridge
