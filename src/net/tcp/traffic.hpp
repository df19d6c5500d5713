// The kernel's counts of a connection.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "core/pacing/repairs.hpp"

namespace connect_bridge {

// Bytes of IP packets, including headers and retransmitted segments, as a provider counts them.
struct Traffic {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;

  Traffic& operator+=(const Traffic& more) {
    sent += more.sent;
    received += more.received;
    return *this;
  }
};

// The kernel's counts of a TCP connection since it was opened, and its present repairs. Zeros: the
// kernel does not report them (before Linux 4.19), or the socket is closed.
struct TcpCounts {
  std::uint64_t sent_bytes = 0;
  std::uint64_t received_bytes = 0;
  std::uint32_t sent_packets = 0;  // modulo 2^32: reached within a month
  std::uint32_t received_packets = 0;
  std::uint64_t segments = 0;              // sent with data, repeated ones included
  std::uint64_t lost = 0;                  // of these repeated, without those that arrived twice
  std::chrono::microseconds round_trip{};  // TCP's own average; 0: not known yet
  Repairs repairs{};                       // `open` is about the direction to the peer
  // Segments of the peer that arrived before an earlier one (Linux 5.4).
  std::uint64_t too_early = 0;
};
// The counts of this socket now (TCP_INFO).
[[nodiscard]] TcpCounts tcp_counts_of(int socket);

// Usual bytes of IP and TCP headers in a packet of the connection: 52, with IPv6 72.
[[nodiscard]] std::uint32_t header_bytes_of(int socket);

// The traffic of one connection, from counts that are taken often enough.
class TrafficMeter {
 public:
  explicit TrafficMeter(std::uint32_t header_bytes) : header_bytes_(header_bytes) {}

  // Adds the counts since the connection was opened. The kernel has no counts of an aborted socket
  // any more: zeros change nothing.
  void count(const TcpCounts& now);
  [[nodiscard]] const Traffic& total() const { return total_; }

 private:
  std::uint32_t header_bytes_;
  Traffic total_;
  TcpCounts last_;
};

// Of a connection until now.
[[nodiscard]] Traffic traffic_of(int socket);

}  // namespace connect_bridge
