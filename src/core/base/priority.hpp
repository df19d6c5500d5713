// The four classes in which messages leave a side. Urgent is strict; the others share by weight.
#pragma once

#include <cstdint>

namespace connect_bridge {

enum class Priority : std::uint8_t { kUrgent, kHigh, kNormal, kBulk };
inline constexpr int kPriorities = 4;

}  // namespace connect_bridge
