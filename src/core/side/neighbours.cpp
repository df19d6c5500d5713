#include "core/side/neighbours.hpp"

#include <set>

#include "core/base/timers.hpp"
#include "core/link/standing.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {
namespace {

// What comes at the same time came before: a claim of another bridge takes so long to arrive.
constexpr Duration kMeanwhile = std::chrono::milliseconds(50);

// A domain and a network, as one number that says nothing (FNV-1a).
Place place_of(const Link& link) {
  Place place;
  const auto& domain = link.accepts->told().domain;
  const std::string& site = link.connection->peer().site;
  if (!domain || site.empty()) return place;
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : std::to_string(*domain) + ' ' + site)
    hash = (hash ^ static_cast<std::uint8_t>(c)) * 1099511628211ULL;
  for (std::size_t i = 0; i < place.bytes.size(); ++i)
    place.bytes[i] = static_cast<std::uint8_t>(hash >> (8 * i));
  return place;
}

bool may_be_one(const Place& a, const Place& b) {
  return a == Place{} || b == Place{} || a == b;
}

// It has said what it accepts, so that it is known where it is.
bool is_known(const Link& link) {
  return link.open() && link.accepts;
}

bool was_before(const Link& other, const Link& link) {
  return other.opened_at < link.opened_at ||
         (other.opened_at == link.opened_at && other.id < link.id);
}

std::vector<Token128> neighbours_of(const Link& link, const LinkTable& links,
                                    const Claims& claims) {
  if (!is_known(link)) return {};
  const Place place = place_of(link);
  std::set<Token128> sides;
  for (const auto& [peer, since] : claims.peers())
    if (since <= link.opened_at + kMeanwhile && may_be_one(peer.place, place))
      sides.insert(peer.side);
  // A client that was started again is not told of the link that it had before.
  for (const auto& [id, other] : links)
    if (is_known(other) && was_before(other, link) && !is_successor(link, other) &&
        may_be_one(place_of(other), place))
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
    if (is_known(link)) peers.push_back({link.peer_side, place_of(link)});
  return peers;
}

std::vector<Token128> Neighbours::tell(const Link& link, const LinkTable& links,
                                       const Claims& claims, const Now& now) {
  auto sides = neighbours_of(link, links, claims);
  Told& told = told_[link.id];
  if (told.sides != sides) told = {sides, now.steady + kPause};
  return sides;
}

std::vector<Link*> Neighbours::take_due(LinkTable& links, Claims& claims, const Now& now) {
  std::vector<Link*> due;
  const bool changed = claims.take_peers_change() || changed_;
  if (!changed && (!due_ || *due_ > now.steady)) return due;
  changed_ = false;
  due_.reset();
  for (auto& [id, link] : links) {
    if (!is_known(link)) continue;
    const Told& told = told_[id];
    if (neighbours_of(link, links, claims) == told.sides) continue;
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
