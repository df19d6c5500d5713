// The hidden topic on which the bridges of a graph tell each other what they mirror.
#pragma once

#include <vector>

#include "core/graph/claims.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// Our publisher and our subscription of it; they exist as long as the side.
class ClaimsTopic {
 public:
  explicit ClaimsTopic(Outputs& outputs);

  // Tells the others. The last claim reaches those that come later.
  void publish(Claim claim, const Now& now);
  // Whether a sample is one of this topic's; then `claims` knows it, and `changed` tells if that
  // made a difference.
  bool on_taken(const MessageTaken& taken, Claims& claims, bool& changed);
  // False: it concerns another topic.
  bool on_failed(const SubscriptionFailed& failed);
  bool on_failed(const MirrorFailed& failed);

 private:
  Outputs& outputs_;
  MirrorId mirror_;
  SubscriptionId subscription_;
};

}  // namespace connect_bridge
