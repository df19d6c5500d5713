// The network traffic of a connection.
#pragma once

#include <cstdint>

namespace connect_bridge {

// Bytes of IP packets, including headers and retransmitted segments: what a provider counts.
struct Traffic {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;

  Traffic& operator+=(const Traffic& more) {
    sent += more.sent;
    received += more.received;
    return *this;
  }
};

// Traffic of a TCP socket since it was opened, as the kernel counts it (Linux 4.19); zeros: not
// known. IP and TCP headers are assumed to have their usual size: 52 bytes, with IPv6 72.
[[nodiscard]] Traffic traffic_of(int socket);

}  // namespace connect_bridge
