// A channel's place in ClassSchedule.
#pragma once

#include <cstdint>

namespace connect_bridge {

// In bytes by the channel's clock, which runs with what it sends.
struct Turn {
  bool scheduled = false;
  std::uint64_t clock = 0;
  std::uint64_t begin = 0;
  std::uint64_t end = 0;  // as expected when it began
};

}  // namespace connect_bridge
