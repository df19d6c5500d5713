// Bridges that may be in the graph of a peer: it waits for their claims before it feeds.
#pragma once

#include <vector>

#include "core/graph/claims.hpp"
#include "core/link/link.hpp"

namespace connect_bridge {

// The sides at the other ends of the open links.
[[nodiscard]] std::vector<Token128> peers_of(const LinkTable& links);

// What the peer of `link` is told: the other peers of this side, and those of other bridges in our
// graph. Two clients that start together do not know of each other, but whom they dial does.
[[nodiscard]] std::vector<Token128> neighbours_of(const Link& link, const LinkTable& links,
                                                  const Claims& claims);

}  // namespace connect_bridge
