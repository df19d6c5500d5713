// What a connection has cost on the network.
#pragma once

#include <cstdint>

namespace connect_bridge {

// Bytes of IP packets, those of headers and of segments that were sent again included: what a
// provider counts.
struct Traffic {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;

  Traffic& operator+=(const Traffic& more) {
    sent += more.sent;
    received += more.received;
    return *this;
  }
};

// Of a TCP socket since it was opened, as the kernel counts it (Linux 4.19); zeros: it does not
// tell. IP and TCP headers are taken for as long as they usually are: 52 bytes, with IPv6 72.
[[nodiscard]] Traffic traffic_of(int socket);

}  // namespace connect_bridge
