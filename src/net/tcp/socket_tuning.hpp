// Linux socket options and counters of one TCP connection.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/ports/net_options.hpp"

namespace connect_bridge {

// Applies the options. Returns those that the host refused, with the reason; empty: none. A
// connection works without any of them.
std::string tune_socket(int socket, const SocketOptions& options);

// Sets TCP_NOTSENT_LOWAT: the socket is writable while fewer bytes than half of this wait unsent.
void set_unsent_bytes_max(int socket, std::uint32_t bytes);

// Bytes handed to the kernel and not sent yet (SIOCOUTQNSD); 0 if the kernel does not support it.
std::uint32_t unsent_bytes(int socket);

// Sets the congestion control. False: the host does not have it, or forbids it.
bool set_congestion_control(int socket, std::string_view name);

// Longest time until TCP repeats an unacknowledged segment. TCP doubles its time with each try:
// after a path was interrupted for 1.5 s, commands would wait another 1.5 s. The result is at least
// 1 s, the kernel's minimum, and longer for long round trips, so that nothing is repeated too
// early.
[[nodiscard]] std::chrono::milliseconds longest_retry(std::chrono::microseconds round_trip);
// Sets that time (TCP_RTO_MAX_MS, since Linux 6.15). Called once a second, since round trips
// change.
void limit_retry(int socket);

}  // namespace connect_bridge
