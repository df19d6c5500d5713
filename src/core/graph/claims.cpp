#include "core/graph/claims.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/base/sha256.hpp"
#include "core/base/timers.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kBridgesMax = 256;
// How long the graph may show a publisher after its bridge has told that it ended.
constexpr Duration kMirrorShown = std::chrono::seconds(30);
// The same of a server. Other than a publisher it has no id in the claim, so a real one of its name
// is taken for it: this is short, unless the bridge has ended without a word.
constexpr Duration kServerShown = std::chrono::seconds(1);
constexpr Duration kServedTurn = std::chrono::milliseconds(100);

}  // namespace

Gid service_gid(std::string_view service) {
  const Digest digest =
      sha256({reinterpret_cast<const std::uint8_t*>(service.data()), service.size()});
  Gid result;
  std::copy_n(digest.begin(), result.bytes.size(), result.bytes.begin());
  return result;
}

bool Claims::update(const Gid& publisher, Claim claim, TimePoint now) {
  if (claim.side == own_) return false;
  hear(claim.side);
  const bool is_last = claim.good_for == Duration::zero();
  const bool is_new = !by_side_.contains(claim.side);
  // Whoever can publish in the graph can write claims, of as many sides as it likes. The last word
  // of a bridge that was never heard ends nothing.
  if (is_new && (by_side_.size() >= kBridgesMax || is_last)) return false;
  Bridge& bridge = by_side_[claim.side];
  bridge.publisher = publisher;
  bridge.ends.reset();
  if (claim.good_for <= kClaimGoodMax) bridge.ends = now + claim.good_for;
  bridge.claim.good_for = claim.good_for;
  if (!is_new && !is_last && bridge.claim == claim) return false;
  // Before the new claim takes the place of the old one: what it does not name any longer has
  // ended, but the graph may still show it.
  end(bridge.claim, claim, false, now);
  if (is_new || is_last || bridge.claim.peers != claim.peers) peers_changed_ = true;
  // Of a bridge that is heard first nobody knows when its links opened: its peers count as earlier
  // than any of ours (core/side/neighbours.cpp).
  const auto before = std::exchange(bridge.peers_since, {});
  for (const auto& [side, place] : claim.peers) {
    const auto known = before.find(side);
    bridge.peers_since[side] = known != before.end() ? known->second : is_new ? TimePoint{} : now;
  }
  if (is_last) {
    by_side_.erase(claim.side);
  } else {
    bridge.claim = std::move(claim);
  }
  rebuild();
  return true;
}

// A bridge whose publisher is not known ends by its last word or by its silence alone.
bool Claims::retain(const std::unordered_set<Gid>& before, const std::unordered_set<Gid>& after,
                    TimePoint now) {
  const auto gone = std::erase_if(by_side_, [&](const auto& entry) {
    const Bridge& bridge = entry.second;
    if (!before.contains(bridge.publisher) || after.contains(bridge.publisher)) return false;
    end(bridge.claim, {}, false, now);
    return true;
  });
  if (gone == 0) return false;
  peers_changed_ = true;
  rebuild();
  return true;
}

bool Claims::expire(TimePoint now) {
  const auto silent = std::erase_if(by_side_, [&](const auto& entry) {
    const Bridge& bridge = entry.second;
    if (!bridge.ends || *bridge.ends > now) return false;
    end(bridge.claim, {}, true, now);
    return true;
  });
  const auto mirrors = ended_.size();
  while (!ended_.empty() && ended_.front().first <= now) ended_.pop_front();
  const bool served = served_ends_ && *served_ends_ <= now && forget_served(now);
  if (silent > 0 || ended_.size() < mirrors) rebuild();
  peers_changed_ = peers_changed_ || silent > 0;
  return silent > 0 || served;
}

std::optional<TimePoint> Claims::deadline() const {
  std::optional<TimePoint> first;
  if (!ended_.empty()) first = ended_.front().first;
  first = earliest(first, served_ends_);
  for (const auto& [side, bridge] : by_side_) first = earliest(first, bridge.ends);
  return first;
}

// The graph shows what a bridge has ended for a while longer: its publishers are mirrors until
// then, its servers no real ones. A bridge that fell silent leaves its servers behind for as long
// as the middleware takes to miss it. They must keep nobody from taking over (is_left_behind),
// while one that ended in order has removed them, or gave way to a real server.
void Claims::end(const Claim& claim, const Claim& next, bool silent, TimePoint now) {
  // A whole second: what ends one by one is not to be forgotten one by one.
  const TimePoint shown = std::chrono::ceil<std::chrono::seconds>(now + kMirrorShown);
  const std::unordered_set<Gid> kept(next.mirrors.begin(), next.mirrors.end());
  for (const Gid& mirror : claim.mirrors) {
    if (kept.contains(mirror)) continue;
    if (ended_.size() >= kClaimOriginsMax) ended_.pop_front();
    ended_.emplace_back(shown, mirror);
  }
  std::unordered_set<Gid> goes_on;
  for (const auto& [gid, feeds] : next.services) goes_on.insert(gid);
  for (const auto& [gid, feeds] : claim.services) {
    if (!feeds || goes_on.contains(gid) || served_.size() >= kClaimOriginsMax) continue;
    const TimePoint until = silent ? shown : now + kServerShown;
    served_[gid] = {until, silent};
    served_ends_ = earliest(served_ends_, until);
  }
}

bool Claims::forget_served(TimePoint now) {
  const auto forgotten =
      std::erase_if(served_, [&](const auto& entry) { return entry.second.until <= now; });
  // Those of a tenth of a second together, however many end one by one.
  served_ends_.reset();
  for (const auto& [gid, served] : served_) served_ends_ = earliest(served_ends_, served.until);
  if (served_ends_) served_ends_ = std::max(*served_ends_, now + kServedTurn);
  return forgotten > 0;
}

void Claims::retain_served(const std::unordered_set<Gid>& shown) {
  std::erase_if(served_, [&](const auto& entry) { return !shown.contains(entry.first); });
  if (served_.empty()) served_ends_.reset();
}

std::vector<Claims::FarPeer> Claims::peers() const {
  std::vector<FarPeer> all;
  for (const auto& [side, bridge] : by_side_)
    for (const ClaimedPeer& peer : bridge.claim.peers)
      all.push_back({peer, bridge.peers_since.at(peer.side)});
  return all;
}

void Claims::expect(LinkId link, const std::vector<Token128>& sides) {
  missed_.erase(link);
  for (const Token128& side : sides)
    if (side != own_ && !by_side_.contains(side)) missed_[link].insert(side);
}

void Claims::hear(const Token128& side) {
  for (auto it = missed_.begin(); it != missed_.end();) {
    it->second.erase(side);
    it = it->second.empty() ? missed_.erase(it) : std::next(it);
  }
}

// A bridge that feeds loses only to another one that feeds and has a smaller side id; one that does
// not yet feed loses to every bridge that feeds, and to smaller ids. All bridges judge the same
// claims by the same rule, so they agree without asking each other.
bool Claims::is_better(const OthersOf& others, const Gid& gid, bool feeds) {
  const auto it = others.find(gid);
  if (it == others.end()) return false;
  if (feeds) return it->second.smaller_feeding;
  return it->second.feeding || it->second.smaller;
}

void Claims::add(const std::vector<Claimed>& claimed, bool smaller, OthersOf& to) {
  for (const auto& [gid, feeds] : claimed) {
    Others& others = to[gid];
    others.feeding |= feeds;
    others.smaller |= smaller;
    others.smaller_feeding |= smaller && feeds;
  }
}

// From all claims, as one entry may have come from several bridges. Claims change seldom, and are
// asked for each origin after each picture of the graph.
void Claims::rebuild() {
  origins_.clear();
  services_.clear();
  mirrors_.clear();
  for (const auto& [side, bridge] : by_side_) {
    const Claim& claim = bridge.claim;
    const bool smaller = claim.side < own_;
    add(claim.origins, smaller, origins_);
    add(claim.services, smaller, services_);
    mirrors_.insert(claim.mirrors.begin(), claim.mirrors.end());
  }
  for (const auto& [until, mirror] : ended_) mirrors_.insert(mirror);
}

}  // namespace connect_bridge
