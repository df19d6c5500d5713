#include "core/graph/claims.hpp"

#include <algorithm>
#include <utility>

#include "core/base/sha256.hpp"
#include "core/base/timers.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kBridgesMax = 256;
// How long the graph may show a publisher after its bridge has announced its end.
constexpr Duration kMirrorShown = std::chrono::seconds(30);
// The same of a server. Other than a publisher it has no id in the claim, so a real one of its name
// is taken for it: this is short, unless the bridge fell silent, as the graph then shows its server
// for as long as the middleware takes to miss it.
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
  if (is_last) {
    by_side_.erase(claim.side);
  } else {
    bridge.claim = std::move(claim);
  }
  rebuild();
  return true;
}

// A bridge whose publisher is not known ends by its last word or by its silence alone.
void Claims::retain(const std::unordered_set<Gid>& before, const std::unordered_set<Gid>& after,
                    TimePoint now) {
  const auto gone = std::erase_if(by_side_, [&](const auto& entry) {
    const Bridge& bridge = entry.second;
    if (!before.contains(bridge.publisher) || after.contains(bridge.publisher)) return false;
    end(bridge.claim, {}, false, now);
    return true;
  });
  if (gone > 0) rebuild();
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
  if (silent > 0 || ended_.size() < mirrors) rebuild();
  if (!served_ends_ || *served_ends_ > now) return silent > 0;
  const auto forgotten =
      std::erase_if(served_, [&](const auto& entry) { return entry.second <= now; });
  // Those of a tenth of a second together, however many end one by one.
  served_ends_.reset();
  for (const auto& [gid, until] : served_) served_ends_ = earliest(served_ends_, until);
  if (served_ends_) served_ends_ = std::max(*served_ends_, now + kServedTurn);
  return silent > 0 || forgotten > 0;
}

std::optional<TimePoint> Claims::deadline() const {
  std::optional<TimePoint> first;
  if (!ended_.empty()) first = ended_.front().first;
  first = earliest(first, served_ends_);
  for (const auto& [side, bridge] : by_side_) first = earliest(first, bridge.ends);
  return first;
}

// The graph shows what a bridge has ended for a while longer: its publishers are mirrors until
// then, its servers no real ones.
void Claims::end(const Claim& claim, const Claim& next, bool silent, TimePoint now) {
  // A whole second: what ends one by one is not to be forgotten one by one.
  const TimePoint shown = std::chrono::ceil<std::chrono::seconds>(now + kMirrorShown);
  const std::unordered_set<Gid> kept(next.mirrors.begin(), next.mirrors.end());
  for (const Gid& mirror : claim.mirrors) {
    if (kept.contains(mirror)) continue;
    if (ended_.size() >= kClaimOriginsMax) ended_.pop_front();
    ended_.emplace_back(shown, mirror);
  }
  const std::unordered_set<Gid> goes_on(next.services.begin(), next.services.end());
  for (const Gid& service : claim.services) {
    if (goes_on.contains(service) || served_.size() >= kClaimOriginsMax) continue;
    const TimePoint until = silent ? shown : now + kServerShown;
    served_[service] = until;
    served_ends_ = earliest(served_ends_, until);
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
    for (const Gid& origin : claim.origins) origins_[origin] |= side < own_;
    for (const Gid& service : claim.services) services_[service] |= side < own_;
    mirrors_.insert(claim.mirrors.begin(), claim.mirrors.end());
  }
  for (const auto& [until, mirror] : ended_) mirrors_.insert(mirror);
}

}  // namespace connect_bridge
