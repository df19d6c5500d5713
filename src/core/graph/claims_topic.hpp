// The hidden topic on which the bridges of a graph tell each other what they mirror.
#pragma once

#include <optional>
#include <vector>

#include "core/base/pace.hpp"
#include "core/graph/claims.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// Our publisher and our subscription on it; they exist as long as the side.
class ClaimsTopic {
 public:
  explicit ClaimsTopic(Outputs& outputs);

  // What this side mirrors has changed.
  void change() { changed_ = true; }
  // Whether the others are to be told of it now: then the caller publishes it. A claim names all
  // that is mirrored, so where much comes and goes it is told now and then.
  [[nodiscard]] bool take_due(const Now& now) {
    if (!changed_ || !pace_.take(now.steady)) return false;
    changed_ = false;
    return true;
  }
  [[nodiscard]] std::optional<TimePoint> deadline() const {
    return changed_ ? std::optional(pace_.free_at()) : std::nullopt;
  }
  // Tells the others. The last claim reaches those that come later.
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
  bool changed_ = false;
  // At most so late that a mirror of a service has not been made yet (core/graph/settling.hpp).
  Pace pace_{20, std::chrono::milliseconds(20)};
};

}  // namespace connect_bridge
