// Limits of services.
#pragma once

#include <cstdint>

namespace connect_bridge {

// Limits for the calls of one peer, all services together.
struct ServiceOptions {
  // Calls that real servers have at a time; more than those of one service, so that one that never
  // answers leaves room for the others.
  std::uint32_t calls_max = 256;
  std::uint32_t calls_waiting_max = 1000;   // calls that wait for their turn
  std::uint64_t call_bytes_max = 64 << 20;  // of requests, and of answers, that are kept
};

}  // namespace connect_bridge
