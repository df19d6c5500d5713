#include "core/graph/claims.hpp"

#include <algorithm>
#include <utility>

#include "core/base/sha256.hpp"
#include "core/base/timers.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kBridgesMax = 256;
// The graph may show a publisher for so long after its bridge has announced its end.
constexpr Duration kMirrorShown = std::chrono::seconds(30);
// The same time for servers. A server has no id in the claim, so a real server of the same name is
// taken for it meanwhile: the time is short. After a silent end it is longer, because the
// middleware shows the server until it notices the loss.
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
  // Any node of the graph can write claims, for as many sides as it likes. The last claim of an
  // unknown bridge ends nothing.
  if (is_new && (by_side_.size() >= kBridgesMax || is_last)) return false;
  Bridge& bridge = by_side_[claim.side];
  bridge.publisher = publisher;
  bridge.ends.reset();
  if (claim.good_for <= kClaimGoodMax) bridge.ends = now + claim.good_for;
  bridge.claim.good_for = claim.good_for;
  if (!is_new && !is_last && bridge.claim == claim) return false;
  // end() needs the old claim: entries that the new one omits have ended, but the graph may still
  // show them.
  end(bridge.claim, claim, false, now);
  if (is_last) {
    by_side_.erase(claim.side);
  } else {
    bridge.claim = std::move(claim);
  }
  rebuild();
  return true;
}

// A bridge with an unknown publisher ends only by its last claim or by its silence.
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
  // One deadline covers a tenth of a second, however many entries expire one by one.
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

// The graph shows the endpoints of an ended claim for a while longer. Until then its publishers
// count as mirrors, and its servers are not real.
void Claims::end(const Claim& claim, const Claim& next, bool silent, TimePoint now) {
  // Whole seconds: entries that end one by one are forgotten together.
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

// Rebuilds the tables from all claims, because one entry may come from several bridges. Claims
// change seldom, but are looked up for each origin after each graph snapshot.
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
