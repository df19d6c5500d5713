// One step of a side, as the loop takes it, and the little that every peer in a bench needs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "bench/processor_time.hpp"
#include "core/side/side.hpp"

namespace bench {

struct SideStep {
  std::vector<connect_bridge::Action> actions;
  std::vector<std::pair<connect_bridge::ConnectionId, connect_bridge::Packet>> packets;
  double seconds = 0;  // of the processor, for the side alone
};

// The side handles an input; what it does and sends is to be looked at after that.
inline SideStep step_of(connect_bridge::Side& side, connect_bridge::Input&& input,
                        const connect_bridge::Now& now) {
  SideStep step;
  const double began = processor_seconds();
  side.handle(std::move(input), now);
  while (auto action = side.next_action()) step.actions.push_back(*std::move(action));
  while (const auto ready = side.take_ready()) {
    bool more = true;
    while (more) {
      auto packet = side.next_packet(*ready, now);
      more = packet && packet->more;
      if (packet) step.packets.emplace_back(*ready, *std::move(packet));
    }
  }
  static_cast<void>(side.next_deadline());
  step.seconds = processor_seconds() - began;
  return step;
}

inline std::string text_of(const connect_bridge::Packet& packet) {
  std::string text;
  for (const auto& piece : packet.pieces) text.append(piece.view().begin(), piece.view().end());
  return text;
}

// Unlike all others of these two numbers.
inline connect_bridge::Gid gid(std::uint32_t i, std::uint8_t kind) {
  connect_bridge::Gid made;
  made.bytes[0] = kind;
  for (std::size_t byte = 0; byte < 4; ++byte)
    made.bytes[byte + 1] = static_cast<std::uint8_t>(i >> (8 * byte));
  return made;
}

}  // namespace bench
