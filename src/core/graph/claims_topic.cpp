#include "core/graph/claims_topic.hpp"

#include <utility>

#include "core/graph/graph_view.hpp"

namespace connect_bridge {
namespace {

constexpr std::uint32_t kBridgesDepth = 100;  // one sample each of so many bridges

}  // namespace

ClaimsTopic::ClaimsTopic(Outputs& outputs)
    : outputs_(outputs), mirror_(outputs.new_mirror()), subscription_(outputs.new_subscription()) {
  Qos qos;
  qos.durability = Durability::kTransientLocal;
  qos.depth = 1;
  outputs_.push(CreateMirror{mirror_, kClaimsTopic, kClaimsType, "", qos});
  qos.depth = kBridgesDepth;
  outputs_.push(CreateSubscription{subscription_, kClaimsTopic, kClaimsType, "", qos});
}

void ClaimsTopic::publish(Claim claim, const Now& now) {
  outputs_.push(Publish{mirror_, serialize(claim, now.system)});
}

bool ClaimsTopic::on_taken(const MessageTaken& taken, Claims& claims, bool& changed) {
  if (taken.subscription != subscription_) return false;
  auto claim = parse_claim(taken.payload.view());
  changed = claim && claims.update(taken.origin, std::move(*claim));
  return true;
}

bool ClaimsTopic::on_failed(const SubscriptionFailed& failed) {
  if (failed.subscription != subscription_) return false;
  outputs_.log(LogLevel::kError,
               "cannot subscribe to the claims of other bridges: " + failed.reason);
  return true;
}

bool ClaimsTopic::on_failed(const MirrorFailed& failed) {
  if (failed.mirror != mirror_) return false;
  outputs_.log(LogLevel::kError, "cannot publish the claims for other bridges: " + failed.reason);
  return true;
}

}  // namespace connect_bridge
