// One process of the bridge: its rules, exports, imports and links. The whole behaviour of ROS2
// Connect between a socket and a ROS graph; docs/architecture.md section "The loop".
#pragma once

#include <memory>
#include <optional>

#include "core/flow/packet.hpp"
#include "core/ports/options.hpp"
#include "core/ports/ports.hpp"
#include "core/ports/status.hpp"

namespace connect_bridge {

// Deterministic: the same seed and inputs give the same actions. Use: handle() one input, then
// drain next_action() and, for each connection that is ready to send, next_packet(); then wait for
// the next input or next_deadline(). Single-threaded. Never throws, never blocks.
class Side {
 public:
  Side(SideOptions options, std::uint64_t seed);
  ~Side();
  Side(const Side&) = delete;
  Side& operator=(const Side&) = delete;

  void handle(Input input, const Now& now);
  std::optional<Action> next_action();
  // The next WebSocket message for this connection; call when the previous one has been handed to
  // the socket.
  std::optional<Packet> next_packet(ConnectionId connection, const Now& now);
  // When handle(TimePassed) must be called at the latest; nullopt: not needed.
  [[nodiscard]] std::optional<TimePoint> next_deadline() const;
  [[nodiscard]] Status status(const Now& now) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace connect_bridge
