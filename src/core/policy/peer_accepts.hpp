// What a peer would import, and what of this side was compared with that so far.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <unordered_map>

#include "core/base/budget.hpp"
#include "core/base/time.hpp"
#include "core/policy/interface.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {

// A peer may tell thousands of long patterns, and to compare one interface with them takes
// milliseconds. So with a long list nothing is compared when it is asked for: the question is
// noted, and answered when its turn comes (AcceptsReview). Single-threaded.
class PeerAccepts {
 public:
  // Lists up to this cost are compared at once, and nothing is kept of that.
  static constexpr std::uint64_t kSmall = 4096;

  // What is remembered of comparisons counts in `memory`; null: nowhere. It outlives this.
  explicit PeerAccepts(Accepts told, Budget* memory = nullptr);

  [[nodiscard]] const Accepts& told() const { return told_; }
  // Of one comparison, roughly in bytes of the patterns that are looked at.
  [[nodiscard]] std::uint64_t cost() const { return cost_; }

  // Whether the peer would take it; nullopt: that is not known yet, and noted.
  [[nodiscard]] std::optional<bool> takes(const Interface& what) const;
  // Something is noted.
  [[nodiscard]] bool lacks() const { return !noted_.empty(); }
  // Compares the first that is noted.
  void compare();
  // It is not to be compared before; for AcceptsReview.
  void rest_until(TimePoint until) { rests_until_ = until; }
  [[nodiscard]] TimePoint rests_until() const { return rests_until_; }

 private:
  struct Noted {
    InterfaceKind kind = InterfaceKind::kTopic;
    std::string name, type, action_type, node;
  };

  Accepts told_;
  std::uint64_t cost_ = 0;
  TimePoint rests_until_{};
  // By the interface; without a value it is noted.
  mutable std::unordered_map<std::string, std::optional<bool>> known_;
  mutable std::deque<Noted> noted_;
  Budget* memory_;
  mutable Budget::Hold held_;  // for both
};

}  // namespace connect_bridge
