// What the kernel counts of a connection.
#pragma once

#include <cstdint>
#include <optional>

#include "core/flow/repairs.hpp"

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

// What TCP repairs now.
struct TcpLosses {
  Repairs repairs;  // `open` is that of the way to the peer
  // Segments of the peer that came before an earlier one, since the connection was opened (Linux
  // 5.4).
  std::uint64_t too_early = 0;
};

// Nothing where the kernel does not tell.
[[nodiscard]] TcpLosses tcp_losses_of(int socket);

// Nullopt: the kernel does not tell (before Linux 4.19).
[[nodiscard]] std::optional<TcpCounts> tcp_counts_of(int socket);

}  // namespace connect_bridge
