// The counters of a gateway.
#pragma once

#include <cstdint>

#include "core/base/time.hpp"

namespace connect_bridge::ros {

struct GatewayCounters {
  // Counts since the start:
  std::uint64_t taken = 0;  // samples from the graph that were given to the core
  std::uint64_t published = 0;
  std::uint64_t refused_calls = 0;  // requests and responses that could not be forwarded
  std::uint64_t graph_readings = 0;
  // Present numbers:
  std::uint32_t subscriptions = 0;
  std::uint32_t mirrors = 0;
  std::uint32_t service_mirrors = 0;
  std::uint32_t service_clients = 0;
  std::uint32_t proxy_nodes = 0;
  std::uint32_t types_not_installed = 0;  // types of messages, requests and responses in use
  std::uint32_t pending_calls = 0;        // requests and invocations that wait for an answer
  Duration graph_reading{};               // duration of the last reading
};

}  // namespace connect_bridge::ros
