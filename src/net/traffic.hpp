// What the kernel counts of a connection.
#pragma once

#include <cstdint>
#include <optional>

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

// All since the connection was opened.
struct TcpCounts {
  std::uint64_t segments = 0;  // sent with data, repeated ones included
  std::uint64_t lost = 0;      // of these repeated, without those that came twice
};

// Nullopt: the kernel does not tell (before Linux 4.19).
[[nodiscard]] std::optional<TcpCounts> tcp_counts_of(int socket);

}  // namespace connect_bridge
