// The hidden topic on which the bridges of a graph announce what they mirror.
#pragma once

#include <algorithm>
#include <optional>

#include "core/base/pace.hpp"
#include "core/graph/claims.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// Our publisher and our subscription on it; they exist as long as the side.
class ClaimsTopic {
 public:
  // `dead_after`: of our links; a claim is good for longer, since so long a mirror may still serve.
  ClaimsTopic(Claims& claims, Duration dead_after, Outputs& outputs);

  // What this side mirrors has changed.
  void change() { changed_ = true; }
  // Whether a claim is due, because of a change or as a sign of life.
  [[nodiscard]] bool is_due(const Now& now) const;
  // The same, and it is at the pace that is allowed: then the caller publishes it. A claim names
  // all that is mirrored, so many changes are published together.
  [[nodiscard]] bool take_due(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;
  // This process stood still for longer than its last claim was good for, beside another bridge:
  // that may have taken all over. Until the next claim is published.
  [[nodiscard]] bool has_lapsed(const Now& now) const {
    return claims_.any() && told_at_ + good_for_ < now.steady;
  }
  // To the other bridges. The last claim reaches those that come later, too.
  void publish(Claim claim, const Now& now);
  // Our last word: we mirror nothing any longer.
  void end(const Token128& side, const Now& now);
  // Whether the sample belongs to this topic; if so, it is added to the claims, and `changed` is
  // set if that changed anything.
  bool on_taken(const MessageTaken& taken, bool& changed, const Now& now);
  // False: it concerns another topic.
  bool on_failed(const SubscriptionFailed& failed);
  bool on_failed(const MirrorFailed& failed);

 private:
  // Between two signs of life with a claim of this size.
  [[nodiscard]] Duration period_of(std::size_t bytes) const;
  // When a change may be published.
  [[nodiscard]] TimePoint changes_at() const;
  // Another bridge may have come since.
  [[nodiscard]] TimePoint repeat_at() const {
    return told_at_ + std::min(period_, period_of(told_bytes_));
  }

  Claims& claims_;
  const Duration dead_after_;
  Outputs& outputs_;
  MirrorId mirror_;
  SubscriptionId subscription_;
  bool changed_ = false;
  TimePoint told_at_{};
  std::size_t told_bytes_ = 0;  // of the last claim
  Duration period_{};           // between the signs of life that the last claim announced
  Duration good_for_{};         // the same
  // At most so late that a mirror of a service has not been made yet (core/graph/claiming.hpp).
  Pace pace_{20, std::chrono::milliseconds(20)};
};

}  // namespace connect_bridge
