// The hidden topic on which the bridges of a graph announce what they mirror.
#pragma once

#include <algorithm>
#include <optional>

#include "core/base/pace.hpp"
#include "core/graph/claims.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// Our publisher and our subscription on this topic; both exist as long as the side.
class ClaimsTopic {
 public:
  // `dead_after` is the time limit of our links. A claim is valid for longer, because a mirror may
  // serve that long.
  ClaimsTopic(Claims& claims, Duration dead_after, Outputs& outputs);

  // The mirrors of this side have changed.
  void change() { changed_ = true; }
  // A claim is due, because of a change or as a sign of life.
  [[nodiscard]] bool is_due(const Now& now) const;
  // True if a claim is due and the pace allows it: the caller then publishes it. A claim names all
  // mirrors, so many changes are published together.
  [[nodiscard]] bool take_due(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;
  // This process, beside another bridge, stood still for longer than its last claim was valid: the
  // other bridge may have taken over everything. True until the next claim is published.
  [[nodiscard]] bool has_lapsed(const Now& now) const {
    return claims_.any() && published_at_ + good_for_ < now.steady;
  }
  // Publishes the claim. The last one also reaches bridges that start later.
  void publish(Claim claim, const Now& now);
  // Publishes our last claim: this side mirrors nothing any longer.
  void end(const Token128& side, const Now& now);
  // Adds the sample to the claims if it belongs to this topic; false if not. `changed` is set if
  // the claims changed.
  bool on_taken(const MessageTaken& taken, bool& changed, const Now& now);
  // False: the failure concerns another topic.
  bool on_failed(const SubscriptionFailed& failed);
  bool on_failed(const MirrorFailed& failed);

 private:
  // The period of repetition for a claim of this size.
  [[nodiscard]] Duration period_of(std::size_t bytes) const;
  // The earliest time at which a change may be published.
  [[nodiscard]] TimePoint changes_at() const;
  // The period may be shorter by now, because another bridge has appeared.
  [[nodiscard]] TimePoint repeat_at() const {
    return published_at_ + std::min(period_, period_of(published_bytes_));
  }

  Claims& claims_;
  const Duration dead_after_;
  Outputs& outputs_;
  MirrorId mirror_;
  SubscriptionId subscription_;
  bool changed_ = false;
  TimePoint published_at_{};
  std::size_t published_bytes_ = 0;  // size of the last claim
  Duration period_{};                // period of repetition that the last claim assumed
  Duration good_for_{};              // validity that the last claim stated
  // Delays are short enough that a service has no mirror before its claim
  // (core/graph/claiming.hpp).
  Pace pace_{20, std::chrono::milliseconds(20)};
};

}  // namespace connect_bridge
