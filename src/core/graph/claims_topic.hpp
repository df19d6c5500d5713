// The hidden topic on which the bridges of a graph tell each other what they mirror.
#pragma once

#include <vector>

#include "core/graph/claims.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// Our publisher and our subscription on it; they exist as long as the side.
class ClaimsTopic {
 public:
  explicit ClaimsTopic(Outputs& outputs);

  // Publishes our claim. Bridges that come later receive the last one.
  void publish(Claim claim, const Now& now);
  // Whether the sample belongs to this topic; if so, it is added to `claims`, and `changed` is set
  // if that changed anything.
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
