#include "core/side/neighbours.hpp"

#include "core/wire/control.hpp"

namespace connect_bridge {

std::vector<Token128> peers_of(const LinkTable& links) {
  std::vector<Token128> sides;
  for (const auto& [id, link] : links)
    if (link.open()) sides.push_back(link.peer_side);
  return sides;
}

std::vector<Token128> neighbours_of(const Link& link, const LinkTable& links,
                                    const Claims& claims) {
  std::set<Token128> sides = claims.peers();
  for (const Token128& side : peers_of(links)) sides.insert(side);
  std::vector<Token128> told;
  for (const Token128& side : sides)
    if (side != link.peer_side && !claims.is_here(side) && told.size() < kNeighboursMax)
      told.push_back(side);
  return told;
}

}  // namespace connect_bridge
