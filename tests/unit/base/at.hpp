// Points of time as milliseconds.
#pragma once

#include "core/base/time.hpp"

namespace connect_bridge::test {

inline TimePoint at(int ms) {
  return TimePoint(std::chrono::milliseconds(ms));
}

}  // namespace connect_bridge::test
