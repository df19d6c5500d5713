#include "core/side/neighbours.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "core/base/fnv.hpp"
#include "core/base/timers.hpp"
#include "core/link/standing.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {
namespace {

// A claim takes up to this long to arrive, so a bridge that is heard within it counts as earlier.
constexpr Duration kMeanwhile = std::chrono::milliseconds(50);
// A client that lives is mostly heard within this time: it acknowledges what it gets.
constexpr Duration kHeard = std::chrono::milliseconds(250);

std::optional<std::uint32_t> domain_of(const Link& link) {
  return link.accepts ? link.accepts->told().domain : std::nullopt;
}

const std::string& site_of(const Link& link) {
  return link.connection()->peer().site;
}

// A domain and a network as one number that says nothing; zero where one of them is not
// known. The peers of other bridges are compared whole: what is not known of them is nowhere.
Place place_of(const Link& link) {
  Place place;
  const auto domain = domain_of(link);
  if (!domain || site_of(link).empty()) return place;
  const std::uint64_t hash = fnv1a(std::to_string(*domain) + ' ' + site_of(link));
  for (std::size_t i = 0; i < place.bytes.size(); ++i)
    place.bytes[i] = static_cast<std::uint8_t>(hash >> (8 * i));
  return place;
}

// IPv4 or IPv6, as the site begins (net/site.hpp); else 0.
char family_of(const std::string& site) {
  return site.starts_with('4') || site.starts_with('6') ? site.front() : '\0';
}

// What is not known may be the same. So may an IPv4 and an IPv6 network: a house has both.
bool may_be_one_site(const std::string& a, const std::string& b) {
  if (a.empty() || b.empty() || a == b) return true;
  return family_of(a) != '\0' && family_of(b) != '\0' && family_of(a) != family_of(b);
}

// Whether both peers of this side may be in one graph, and the other one came before.
bool is_neighbour(const Link& link, const Link& other) {
  const bool before = other.life.opened_at() < link.life.opened_at() ||
                      (other.life.opened_at() == link.life.opened_at() && other.id < link.id);
  if (!before || !other.open()) return false;
  const auto here = domain_of(link), there = domain_of(other);
  return (!here || !there || here == there) && may_be_one_site(site_of(link), site_of(other));
}

bool may_wait(const Link& link, const Now& now) {
  return link.open() && now.steady < link.life.opened_at() + Neighbours::kWaits;
}

using FarPeers = std::map<Place, std::vector<Claims::FarPeer>>;

// The peers of other bridges, by their places.
FarPeers far_peers(const Claims& claims) {
  FarPeers far;
  for (auto& peer : claims.peers())
    if (peer.peer.place != Place{}) far[peer.peer.place].push_back(peer);
  return far;
}

// True: it was not there before.
bool add(std::set<Token128>& sides, const Token128& side, const Link& link, const Claims& claims) {
  if (side == link.peer().side || claims.is_here(side) || sides.size() >= kNeighboursMax)
    return false;
  return sides.insert(side).second;
}

bool add_far(std::set<Token128>& sides, const FarPeers& far, const Link& link,
             const Claims& claims) {
  const auto found = far.find(place_of(link));
  if (found == far.end()) return false;
  bool added = false;
  for (const auto& [peer, since] : found->second)
    if (since <= link.life.opened_at() + kMeanwhile) added |= add(sides, peer.side, link, claims);
  return added;
}

}  // namespace

std::vector<ClaimedPeer> peers_of(const LinkTable& links) {
  std::vector<ClaimedPeer> peers;
  for (const auto& [id, link] : links) {
    if (!link.open()) continue;
    if (const Place place = place_of(link); place != Place{})
      peers.push_back({link.peer().side, place});
  }
  return peers;
}

// The link that a client had before it was started again is not its neighbour. But two clients may
// have one identity and one name: the same launch file on two machines.
Neighbours::Told& Neighbours::look(const Link& link, const LinkTable& links, const Claims& claims,
                                   const Now& now) {
  // From nothing: what was told before may have named peers that stand elsewhere, as is known now.
  Told& told = told_[link.id] = {};
  add_far(told.sides, far_peers(claims), link, claims);
  for (const auto& [id, other] : links) {
    if (!is_neighbour(link, other)) continue;
    if (!is_successor(link, other)) {
      add(told.sides, other.peer().side, link, claims);
    } else if (told.elders.size() < kNeighboursMax) {
      told.elders.push_back(id);
    }
  }
  take_living(told, link, links, claims);
  if (!told.elders.empty()) due_ = earliest(due_, std::max(free_at_, now.steady + kHeard));
  return told;
}

// A link that is heard after the newer one opened was not that client's. True: some were added.
bool Neighbours::take_living(Told& told, const Link& link, const LinkTable& links,
                             const Claims& claims) {
  bool added = false;
  std::erase_if(told.elders, [&](LinkId id) {
    const auto other = links.find(id);
    if (other == links.end() || !is_neighbour(link, other->second)) return true;
    if (other->second.connection()->last_heard() <= link.life.opened_at()) return false;
    added |= add(told.sides, other->second.peer().side, link, claims);
    return true;
  });
  return added;
}

std::vector<Token128> Neighbours::tell(const Link& link, const LinkTable& links,
                                       const Claims& claims, const Now& now) {
  if (!may_wait(link, now)) return {};
  // `accepts` is sent for other reasons, too: then the same neighbours are in it, as a list
  // replaces the one before (docs/protocol.md section 7, rule 5).
  const auto known = told_.find(link.id);
  const Told& told = known != told_.end() ? known->second : look(link, links, claims, now);
  return {told.sides.begin(), told.sides.end()};
}

bool Neighbours::locate(const Link& link, const LinkTable& links, const Claims& claims,
                        const Now& now) {
  if (!may_wait(link, now)) return false;
  const auto before = std::exchange(told_[link.id].sides, {});
  return look(link, links, claims, now).sides != before;
}

std::vector<Link*> Neighbours::take_due(LinkTable& links, Claims& claims, const Now& now) {
  std::vector<Link*> due;
  if (claims.take_peers_change()) due_ = earliest(due_, std::max(free_at_, now.steady));
  if (!due_ || *due_ > now.steady) return due;
  due_.reset();
  free_at_ = now.steady + kPause;
  std::erase_if(told_, [&](const auto& entry) {
    const auto found = links.find(entry.first);
    return found == links.end() || !may_wait(found->second, now);
  });
  if (told_.empty()) return due;
  const FarPeers far = far_peers(claims);
  // A later list only grows (docs/protocol.md section 7, rule 5): who was named is waited for
  // already.
  for (auto& [id, told] : told_) {
    Link& link = links.at(id);
    const bool farther = add_far(told.sides, far, link, claims);
    if (take_living(told, link, links, claims) || farther) due.push_back(&link);
    if (!told.elders.empty()) due_ = free_at_;
  }
  return due;
}

}  // namespace connect_bridge
