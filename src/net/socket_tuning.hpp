// Linux socket options and counters of one TCP connection.
#pragma once

#include <cstdint>
#include <string>

#include "net/congestion_choice.hpp"
#include "net/options.hpp"
#include "net/repair_watch.hpp"

namespace connect_bridge {

// Applies the options. Returns what the host refused, in words; empty: nothing. A connection works
// without any of them.
std::string tune_socket(int socket, const SocketOptions& options);

// TCP_NOTSENT_LOWAT: the socket is writable while fewer bytes than half of this wait unsent.
void set_unsent_bytes_max(int socket, std::uint32_t bytes);

// Bytes handed to the kernel and not sent yet (SIOCOUTQNSD); 0 if the kernel does not support it.
std::uint32_t unsent_bytes(int socket);

// Sets what the choice says, as far as the host allows it. Once a second.
void retune(int socket, CongestionChoice& choice, TimePoint now);
std::string congestion_control_of(int socket);

// What TCP repairs; the kernel is asked when that is due.
[[nodiscard]] Repairs repairs_of(int socket, RepairWatch& watch, TimePoint now);
// To be called when something was read.
void note_read(int socket, RepairWatch& watch);

}  // namespace connect_bridge
