// What the end of a connection means for the link that it carried.
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "core/link/options.hpp"

namespace connect_bridge {

class Link;

enum class Loss : std::uint8_t {
  kBreak,    // the link is dead after dead_after of silence, and may return
  kRestart,  // the same, but the peer will remember nothing
  kSilence,  // it is dead at once, and may return
  kEnd,      // it is dead at once, and for ever
};

// The peer, or the network, has ended the connection with this code. `role`: ours.
[[nodiscard]] Loss loss_by(std::optional<std::uint16_t> close_code, Role role);
// This side ends the link's connection.
[[nodiscard]] Loss loss_by(const Error& ours, const Link& link, const Now& now);

[[nodiscard]] inline bool is_dead(Loss loss) {
  return loss == Loss::kSilence || loss == Loss::kEnd;
}

}  // namespace connect_bridge
