// Quality of service of a ROS topic endpoint, as a value (REP-2003 and the rmw QoS policies).
#pragma once

#include <cstdint>

#include "core/base/time.hpp"

namespace connect_bridge {

enum class Reliability : std::uint8_t { kBestEffort, kReliable };
enum class Durability : std::uint8_t { kVolatile, kTransientLocal };
enum class History : std::uint8_t { kKeepLast, kKeepAll };
enum class Liveliness : std::uint8_t { kAutomatic, kManualByTopic };

struct Qos {
  Reliability reliability = Reliability::kReliable;
  Durability durability = Durability::kVolatile;
  History history = History::kKeepLast;
  std::uint32_t depth = 0;       // samples; 0: not known from the graph
  Duration deadline = kForever;  // kForever: none
  Duration lifespan = kForever;  // kForever: none
  Liveliness liveliness = Liveliness::kAutomatic;
  Duration liveliness_lease = kForever;
  bool operator==(const Qos&) const = default;
};

}  // namespace connect_bridge
