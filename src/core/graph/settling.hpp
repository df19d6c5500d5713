// How long a new mirror waits for what other bridges of this graph claim.
#pragma once

#include "core/base/time.hpp"

namespace connect_bridge {

// After a start the local graph is still being discovered.
inline constexpr Duration kDiscovery = std::chrono::milliseconds(500);
// Before a topic's mirror asks for data.
inline constexpr Duration kTopicSettle = std::chrono::milliseconds(250);
// Before a service's mirror takes calls. Services of an action wait for its topics: a caller that
// finds the action ready sends a goal at once, and its first feedback must get through.
inline constexpr Duration kServiceSettle = std::chrono::milliseconds(150);
inline constexpr Duration kActionSettle = kTopicSettle;

}  // namespace connect_bridge
