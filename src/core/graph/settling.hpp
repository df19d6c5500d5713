// How long a new mirror waits for what other bridges of this graph claim.
#pragma once

#include "core/base/time.hpp"

namespace connect_bridge {

// After a start the local graph is still being discovered.
inline constexpr Duration kDiscovery = std::chrono::milliseconds(500);
// The same of a bridge that may be in this graph, as a peer says, and that is not heard: Fast DDS
// at times knows another process only when that announces itself again, after up to 3 s.
inline constexpr Duration kNeighbourDiscovery = std::chrono::milliseconds(3500);
// Within this time a claim names a mirror that the graph shows.
inline constexpr Duration kClaimNames = std::chrono::milliseconds(150);
// Within this time the graph tells the node of a publisher, if at all. Shorter than its samples are
// parked (core/topics/exported_topic.cpp).
inline constexpr Duration kNodeNames = std::chrono::milliseconds(900);
// Before a topic's mirror asks for data.
inline constexpr Duration kTopicSettle = std::chrono::milliseconds(250);
// Before a service's mirror takes calls.
inline constexpr Duration kServiceSettle = std::chrono::milliseconds(150);
// Services of an action wait for its topics: a caller that finds the action ready sends a goal at
// once, and its first feedback must get through. After this time they come without.
inline constexpr Duration kActionTopics = std::chrono::seconds(2);

}  // namespace connect_bridge
