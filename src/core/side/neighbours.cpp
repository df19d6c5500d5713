#include "core/side/neighbours.hpp"

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <utility>

#include "core/base/timers.hpp"
#include "core/link/standing.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {
namespace {

// What comes at the same time came before: a claim of another bridge takes so long to arrive.
constexpr Duration kMeanwhile = std::chrono::milliseconds(50);

std::optional<std::uint32_t> domain_of(const Link& link) {
  return link.accepts ? link.accepts->told().domain : std::nullopt;
}

const std::string& site_of(const Link& link) {
  return link.connection->peer().site;
}

// A domain and a network as one number that says nothing (FNV-1a).
Place place_of(const Link& link) {
  Place place;
  const auto domain = domain_of(link);
  if (!domain || site_of(link).empty()) return place;
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : std::to_string(*domain) + ' ' + site_of(link))
    hash = (hash ^ static_cast<std::uint8_t>(c)) * 1099511628211ULL;
  for (std::size_t i = 0; i < place.bytes.size(); ++i)
    place.bytes[i] = static_cast<std::uint8_t>(hash >> (8 * i));
  return place;
}

// What is not known may be the same.
template <class T>
bool may_be_one(const T& a, const T& b) {
  return a == T{} || b == T{} || a == b;
}

bool was_before(const Link& other, const Link& link) {
  return other.opened_at < link.opened_at ||
         (other.opened_at == link.opened_at && other.id < link.id);
}

std::vector<Token128> neighbours_of(const Link& link, const LinkTable& links,
                                    const Claims& claims) {
  const Place place = place_of(link);
  std::set<Token128> sides;
  for (const auto& [peer, since] : claims.peers())
    if (since <= link.opened_at + kMeanwhile && may_be_one(peer.place, place))
      sides.insert(peer.side);
  // A client that was started again is not told of the link that it had before.
  for (const auto& [id, other] : links)
    if (other.open() && was_before(other, link) && !is_successor(link, other) &&
        may_be_one(site_of(other), site_of(link)) && may_be_one(domain_of(other), domain_of(link)))
      sides.insert(other.peer_side);
  std::vector<Token128> told;
  for (const Token128& side : sides)
    if (side != link.peer_side && !claims.is_here(side) && told.size() < kNeighboursMax)
      told.push_back(side);
  return told;
}

}  // namespace

std::vector<ClaimedPeer> peers_of(const LinkTable& links) {
  std::vector<ClaimedPeer> peers;
  for (const auto& [id, link] : links)
    if (link.open() && link.accepts) peers.push_back({link.peer_side, place_of(link)});
  return peers;
}

std::vector<Token128> Neighbours::tell(const Link& link, const LinkTable& links,
                                       const Claims& claims, const Now& now) {
  auto sides = neighbours_of(link, links, claims);
  Told& told = told_[link.id];
  if (told.sides != sides && link.accepts) told.free_at = now.steady + kPause;
  told.sides = sides;
  return sides;
}

std::vector<Link*> Neighbours::take_due(LinkTable& links, Claims& claims, const Now& now) {
  std::vector<Link*> due;
  const bool changed = claims.take_peers_change() || changed_;
  if (!changed && (!due_ || *due_ > now.steady)) return due;
  changed_ = false;
  due_.reset();
  for (auto& [id, link] : links) {
    if (!link.open()) continue;
    Told& told = told_[id];
    const auto sides = neighbours_of(link, links, claims);
    // At the opening it was not known where the peer is: then it may have been told of too many.
    const bool answers = link.accepts && !std::exchange(told.answered, true);
    const bool knows_all =
        std::includes(told.sides.begin(), told.sides.end(), sides.begin(), sides.end());
    if (answers ? told.sides == sides : knows_all) continue;
    if (told.free_at <= now.steady) {
      due.push_back(&link);
    } else {
      due_ = earliest(due_, told.free_at);
    }
  }
  return due;
}

void Neighbours::on_link_lost(LinkId link) {
  told_.erase(link);
  changed_ = true;
}

}  // namespace connect_bridge
