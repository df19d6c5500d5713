// The results that the network reports, and the counts of its listener.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "core/base/ids.hpp"
#include "core/flow/outbox.hpp"
#include "core/ports/ports.hpp"

namespace connect_bridge {

// The callbacks for the network's results. The io_context calls `input` and `arrived`, and no call
// of Network does. send() calls next_packet. All of Network may be called from inside these two.
struct NetworkEvents {
  // ConnectionOpened, DialFailed, ConnectionClosed; NetworkChanged after a dial.
  std::function<void(Input&&)> input;
  // The next packet to send on a connection, or nullopt when there is none now; with what TCP
  // repairs there.
  std::function<std::optional<Packet>(ConnectionId, const Repairs&)> next_packet;
  // A packet has come. Nothing else is read on its connection until read_on().
  std::function<void(PacketReceived&&)> arrived;
  // May be empty. Attempts of unknown clients are logged at kDebug.
  std::function<void(Log&&)> log;
};

// Counts of the connections that came to a listener since the start, by what became of them.
struct DoorCounts {
  std::uint64_t accepted = 0;            // TCP connections taken
  std::uint64_t refused = 0;             // by a limit, a failed handshake or a wrong request
  std::uint64_t handshakes_dropped = 0;  // their address had begun too many
  std::uint64_t handshakes_waited = 0;   // for their turn, since all together had begun too many
  std::uint64_t gave_way = 0;            // without a login, to those that came later
  std::uint64_t proxy_headers = 0;       // refused: they began with a PROXY header
  std::string last_refused{};            // "203.0.113.5: HTTP 400: ...", text for people
};

}  // namespace connect_bridge
