// A link that offers the origin of a mirror.
#pragma once

#include <algorithm>

#include "core/base/qos.hpp"
#include "core/link/link.hpp"

namespace connect_bridge {

class OfferedTopic;

struct MirrorCandidate {
  Link* link = nullptr;
  OfferedTopic* offered = nullptr;  // null: it is lost, or has not offered it again
  bool declined = false;            // its type, and the peer has not withdrawn it yet
  Qos qos{};                        // of the origin, as this link offers it
  bool told = false;                // that no publisher could be made, whatever the reason

  [[nodiscard]] bool is_usable() const { return offered && !declined; }
};

// Null: the link is not one of them.
template <class Candidates>
auto* find_candidate(Candidates& candidates, LinkId link) {
  const auto it = std::find_if(candidates.begin(), candidates.end(),
                               [&](const MirrorCandidate& c) { return c.link->id == link; });
  return it == candidates.end() ? nullptr : &*it;
}

}  // namespace connect_bridge
