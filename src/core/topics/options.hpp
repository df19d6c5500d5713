// What the operator sets for topics.
#pragma once

#include <cstdint>

#include "core/base/time.hpp"

namespace connect_bridge {

struct TopicOptions {
  std::uint32_t default_depth = 100;           // queue and mirror depth where the graph gives none
  std::uint32_t latched_depth = 10;            // the same for transient local
  std::uint64_t history_bytes_max = 64 << 20;  // transient-local samples kept for later links
  std::uint32_t mirrors_max = 16384;           // of all peers together
  Duration clock_publish_period = Duration::zero();  // > 0: publish the peer's ROS time on /clock
};

}  // namespace connect_bridge
