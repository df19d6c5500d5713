#include "core/graph/claims.hpp"

#include <algorithm>
#include <utility>

#include "core/base/timers.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kBridgesMax = 256;
// How long the graph may show a publisher after its bridge has told that it ended.
constexpr Duration kMirrorShown = std::chrono::seconds(30);

}  // namespace

Gid service_gid(std::string_view service) {
  Gid result;
  for (std::size_t word = 0; word < 3; ++word) {
    std::uint64_t hash = 14695981039346656037ULL + word;  // FNV-1a
    const auto add = [&](std::string_view text) {
      for (const char c : text) hash = (hash ^ static_cast<std::uint8_t>(c)) * 1099511628211ULL;
    };
    add("service:");
    add(service);
    for (std::size_t i = 0; i < 8; ++i)
      result.bytes[8 * word + i] = static_cast<std::uint8_t>(hash >> (8 * i));
  }
  return result;
}

bool Claims::update(const Gid& publisher, Claim claim, TimePoint now) {
  if (claim.side == own_) return false;
  missed_.erase(claim.side);
  const auto known = by_side_.find(claim.side);
  const bool is_new = known == by_side_.end();
  if (is_new && (by_side_.size() >= kBridgesMax || claim.good_for == Duration::zero()))
    return false;
  std::optional<TimePoint> ends;
  if (claim.good_for <= kClaimGoodMax) ends = now + claim.good_for;
  if (!is_new) {
    Bridge& bridge = known->second;
    bridge.publisher = publisher;
    bridge.ends = ends;
    bridge.claim.good_for = claim.good_for;
    if (bridge.claim == claim && claim.good_for > Duration::zero()) return false;
    end_mirrors(bridge.claim, claim.mirrors, now);
  }
  if (claim.good_for == Duration::zero()) {
    by_side_.erase(known);
  } else {
    const Token128 side = claim.side;
    by_side_[side] = {std::move(claim), publisher, ends};
  }
  rebuild();
  return true;
}

// Whose publisher is not told ends by its last word or by its silence alone.
bool Claims::retain(const std::unordered_set<Gid>& before, const std::unordered_set<Gid>& now) {
  const auto gone = std::erase_if(by_side_, [&](const auto& entry) {
    const Gid& publisher = entry.second.publisher;
    return before.contains(publisher) && !now.contains(publisher);
  });
  if (gone > 0) rebuild();
  return gone > 0;
}

bool Claims::expire(TimePoint now) {
  bool changed = false;
  for (; !ended_.empty() && ended_.front().first <= now; changed = true) ended_.pop_front();
  for (auto it = by_side_.begin(); it != by_side_.end();) {
    if (!it->second.ends || *it->second.ends > now) {
      ++it;
      continue;
    }
    end_mirrors(it->second.claim, {}, now);
    it = by_side_.erase(it);
    changed = true;
  }
  if (changed) rebuild();
  return changed;
}

std::optional<TimePoint> Claims::deadline() const {
  std::optional<TimePoint> first;
  if (!ended_.empty()) first = ended_.front().first;
  for (const auto& [side, bridge] : by_side_) first = earliest(first, bridge.ends);
  return first;
}

void Claims::end_mirrors(const Claim& claim, const std::vector<Gid>& kept, TimePoint now) {
  const std::unordered_set<Gid> go_on(kept.begin(), kept.end());
  for (const Gid& mirror : claim.mirrors) {
    if (go_on.contains(mirror)) continue;
    if (ended_.size() >= kClaimOriginsMax) ended_.pop_front();
    ended_.emplace_back(now + kMirrorShown, mirror);
  }
}

std::set<Token128> Claims::peers() const {
  std::set<Token128> all;
  for (const auto& [side, bridge] : by_side_)
    all.insert(bridge.claim.peers.begin(), bridge.claim.peers.end());
  return all;
}

void Claims::expect(const std::vector<Token128>& sides) {
  for (const Token128& side : sides)
    if (side != own_ && !by_side_.contains(side) && missed_.size() < kBridgesMax)
      missed_.insert(side);
}

bool Claims::taken(const Gid& origin, bool feeds) const {
  const auto it = claimed_.find(origin);
  if (it == claimed_.end()) return false;
  const Others& others = it->second;
  if (feeds) return others.smaller_feeding;
  return others.feeding || others.smaller;
}

void Claims::rebuild() {
  claimed_.clear();
  mirrors_.clear();
  for (const auto& [side, bridge] : by_side_) {
    const Claim& claim = bridge.claim;
    const bool smaller = claim.side < own_;
    for (const auto& [gid, feeds] : claim.origins) {
      Others& others = claimed_[gid];
      others.feeding |= feeds;
      others.smaller |= smaller;
      others.smaller_feeding |= smaller && feeds;
    }
    mirrors_.insert(claim.mirrors.begin(), claim.mirrors.end());
  }
  for (const auto& [until, mirror] : ended_) mirrors_.insert(mirror);
}

}  // namespace connect_bridge
