// Limits of services.
#pragma once

#include <cstdint>

namespace connect_bridge {

// Limits for the calls of one peer, for all services together.
struct ServiceOptions {
  std::uint32_t calls_waiting_max = 1000;   // calls that wait for their turn
  std::uint64_t call_bytes_max = 64 << 20;  // kept requests, and kept answers
};

}  // namespace connect_bridge
