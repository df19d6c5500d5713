// What the kernel counts of a connection.
#pragma once

#include <chrono>
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

// What the kernel has counted of a TCP socket since that was opened.
struct TrafficCounts {
  std::uint64_t sent_bytes = 0;
  std::uint64_t received_bytes = 0;
  std::uint32_t sent_segments = 0;  // modulo 2^32: reached within a month
  std::uint32_t received_segments = 0;
  std::uint32_t header_bytes = 0;  // of IP and TCP, as they usually are: 52, with IPv6 72
};

// Nullopt: not known (before Linux 4.19).
[[nodiscard]] std::optional<TrafficCounts> traffic_counts_of(int socket);

// The traffic of one connection, from counts that are taken often enough.
class TrafficMeter {
 public:
  // What was counted since the connection was opened. Of an aborted socket the kernel has no counts
  // any more: these change nothing.
  void count(const TrafficCounts& now);
  [[nodiscard]] const Traffic& total() const { return total_; }

 private:
  Traffic total_;
  TrafficCounts last_;
};

// All since the connection was opened.
struct TcpCounts {
  std::uint64_t segments = 0;              // sent with data, repeated ones included
  std::uint64_t lost = 0;                  // of these repeated, without those that came twice
  std::chrono::microseconds round_trip{};  // TCP's own average; 0: not known yet
};

// What TCP repairs now.
struct TcpLosses {
  Repairs repairs;  // `open` is that of the way to the peer
  // Segments of the peer that came before an earlier one, since the connection was opened (Linux
  // 5.4).
  std::uint64_t too_early = 0;
};

// Zeros where the kernel does not report them.
[[nodiscard]] TcpLosses tcp_losses_of(int socket);

// TCP's own average; 0: not known yet.
[[nodiscard]] std::chrono::microseconds tcp_round_trip_of(int socket);

// Nullopt: the kernel does not report it (before Linux 4.19).
[[nodiscard]] std::optional<TcpCounts> tcp_counts_of(int socket);

}  // namespace connect_bridge
