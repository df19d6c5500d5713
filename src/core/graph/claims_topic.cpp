#include "core/graph/claims_topic.hpp"

#include <algorithm>
#include <utility>

#include "core/base/timers.hpp"
#include "core/graph/graph_view.hpp"

namespace connect_bridge {
namespace {

constexpr std::uint32_t kBridgesDepth = 100;  // one sample each of this many bridges
// Claims are repeated as a sign of life, and expire after kMissingMax missed repetitions. Without
// another known bridge the repetition serves bridges that start later.
constexpr Duration kBesideOthers = std::chrono::seconds(1);
constexpr Duration kAlone = std::chrono::seconds(3);
constexpr int kMissingMax = 3;
constexpr Duration kAfterDead = std::chrono::seconds(1);
// Large claims are repeated less often, so that each shortest period costs about so many bytes.
constexpr std::size_t kPeriodBytes = 50'000;
// Changes of a large claim are paced, too, so that the loop has time for other work. Beside another
// bridge a change is published within kClaimNames, while that bridge still holds back our new
// publisher.
constexpr std::size_t kLargeBytes = 10'000;
constexpr Duration kRestOfByte = std::chrono::microseconds(1);
constexpr Duration kRestMax = std::chrono::milliseconds(400);
constexpr Duration kRestBesideOthersMax = std::chrono::milliseconds(100);

}  // namespace

ClaimsTopic::ClaimsTopic(Claims& claims, Duration dead_after, Outputs& outputs)
    : claims_(claims),
      dead_after_(dead_after),
      outputs_(outputs),
      mirror_(outputs.new_id<MirrorId>()),
      subscription_(outputs.new_id<SubscriptionId>()) {
  Qos qos;
  qos.durability = Durability::kTransientLocal;
  qos.depth = 1;
  outputs_.push(CreateMirror{mirror_, kClaimsTopic, kClaimsType, "", qos, "", true});
  qos.depth = kBridgesDepth;
  outputs_.push(CreateSubscription{subscription_, kClaimsTopic, kClaimsType, "", qos});
}

Duration ClaimsTopic::period_of(std::size_t bytes) const {
  // A long period is no obstacle when another bridge appears: repeat_at() then takes the shorter
  // period at once.
  const Duration shortest = claims_.any() ? kBesideOthers : kAlone;
  return shortest * static_cast<std::int64_t>(1 + bytes / kPeriodBytes);
}

bool ClaimsTopic::is_due(const Now& now) const {
  return (changed_ && changes_at() <= now.steady) ||
         repeat_at() <= now.steady;  // mutant: claims_repeat
}

bool ClaimsTopic::take_due(const Now& now) {
  // Changes that come too soon after many others are not lost: `changed_` stays until the pace
  // allows a claim, which then names all of them (docs/protocol.md section 14, rule 2).
  if (!is_due(now) || !pace_.take(now.steady)) return false;
  changed_ = false;
  return true;
}

TimePoint ClaimsTopic::changes_at() const {
  if (published_bytes_ < kLargeBytes) return published_at_;
  const Duration rest = kRestOfByte * static_cast<std::int64_t>(published_bytes_);
  return published_at_ + std::min(rest, claims_.any() ? kRestBesideOthersMax : kRestMax);
}

std::optional<TimePoint> ClaimsTopic::deadline() const {
  const TimePoint at = changed_ ? std::min(changes_at(), repeat_at()) : repeat_at();
  const TimePoint due = std::max(at, pace_.free_at());
  return earliest(due, claims_.deadline());
}

void ClaimsTopic::publish(Claim claim, const Now& now) {
  published_at_ = now.steady;
  published_bytes_ = claim_bytes(claim);
  period_ = period_of(published_bytes_);
  // A silent bridge may still serve calls until its peer notices the loss.
  const Duration good = std::max<Duration>(kMissingMax * period_, dead_after_ + kAfterDead);
  good_for_ = std::min(good, kClaimGoodMax);
  claim.good_for = std::chrono::ceil<std::chrono::milliseconds>(good_for_);
  outputs_.push(Publish{mirror_, serialize(claim, now.system)});
}

void ClaimsTopic::end(const Token128& side, const Now& now) {
  Claim last{side, {}};
  last.good_for = Duration::zero();
  outputs_.push(Publish{mirror_, serialize(last, now.system)});
}

bool ClaimsTopic::on_taken(const MessageTaken& taken, bool& changed, const Now& now) {
  if (taken.subscription != subscription_) return false;
  auto claim = parse_claim(taken.payload.view());
  changed = claim && claims_.update(taken.origin, std::move(*claim), now.steady);
  return true;
}

bool ClaimsTopic::on_failed(const SubscriptionFailed& failed) {
  if (failed.id != subscription_) return false;
  outputs_.log(LogLevel::kError,
               "cannot subscribe to the claims of other bridges: " + failed.reason);
  return true;
}

bool ClaimsTopic::on_failed(const MirrorFailed& failed) {
  if (failed.id != mirror_) return false;
  outputs_.log(LogLevel::kError, "cannot publish the claims for other bridges: " + failed.reason);
  return true;
}

}  // namespace connect_bridge
