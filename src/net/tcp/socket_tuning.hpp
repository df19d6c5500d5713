// Linux socket options and counters of one TCP connection.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/ports/net_options.hpp"

namespace connect_bridge {

// Applies the options. Returns what the host refused, in words; empty: nothing. A connection works
// without any of them.
std::string tune_socket(int socket, const SocketOptions& options);

// TCP_NOTSENT_LOWAT: the socket is writable while fewer bytes than half of this wait unsent.
void set_unsent_bytes_max(int socket, std::uint32_t bytes);

// Bytes handed to the kernel and not sent yet (SIOCOUTQNSD); 0 if the kernel does not support it.
std::uint32_t unsent_bytes(int socket);

// False: the host does not have it, or not for us.
bool set_congestion_control(int socket, std::string_view name);

// How long TCP waits at most until it sends again what nobody has acknowledged. It doubles that
// time with each try: after a path was interrupted for 1.5 s, commands would wait another 1.5 s. At
// least 1 s, the least that the kernel takes; longer where round trips are, so that nothing is
// repeated too early.
[[nodiscard]] std::chrono::milliseconds longest_retry(std::chrono::microseconds round_trip);
// Sets it (TCP_RTO_MAX_MS, since Linux 6.15). Once a second: round trips change.
void limit_retry(int socket);

}  // namespace connect_bridge
