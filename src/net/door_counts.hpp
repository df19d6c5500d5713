// What became of those who came to a listener.
#pragma once

#include <cstdint>

namespace connect_bridge {

// Since the start.
struct DoorCounts {
  std::uint64_t accepted = 0;            // TCP connections taken
  std::uint64_t refused = 0;             // by a limit, a failed handshake or a wrong request
  std::uint64_t handshakes_dropped = 0;  // their address had begun too many
  std::uint64_t handshakes_waited = 0;   // for their turn, since all together had begun too many
  std::uint64_t gave_way = 0;            // without a login, to those that came later
};

}  // namespace connect_bridge
