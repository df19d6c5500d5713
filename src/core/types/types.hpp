// All of a side's talk about types: what it asks its peers, what it answers them, and what it
// lacks.
#pragma once

#include <optional>

#include "core/ports/inputs.hpp"
#include "core/types/peer_types.hpp"
#include "core/types/type_answers.hpp"
#include "core/types/type_lacks.hpp"

namespace connect_bridge {

// Single-threaded; owned by the side.
class Types {
 public:
  explicit Types(const SideView& side) : peers(side.outputs), answers(side.outputs), lacks(side) {}

  // Every input goes through here first; what does not concern types is ignored.
  void handle(const Input& input, const Now& now);
  void on_link_lost(Link& link);
  [[nodiscard]] std::optional<TimePoint> deadline() const {
    return earliest(peers.deadline(), answers.deadline());
  }

  PeerTypes peers;
  TypeAnswers answers;
  TypeLacks lacks;
};

}  // namespace connect_bridge
