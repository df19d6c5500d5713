// Limits of services.
#pragma once

#include <cstdint>

namespace connect_bridge {

// Limits for the calls of one peer, all services together.
struct ServiceOptions {
  std::uint32_t calls_waiting_max = 1000;   // calls that wait for their turn
  std::uint64_t call_bytes_max = 64 << 20;  // of requests, and of answers, that are kept
};

}  // namespace connect_bridge
