// The clock of deadlines and rates.
#pragma once

#include <chrono>

#include "core/base/time.hpp"

namespace connect_bridge {

[[nodiscard]] inline TimePoint steady_now() {
  return TimePoint(std::chrono::steady_clock::now().time_since_epoch());
}

}  // namespace connect_bridge
