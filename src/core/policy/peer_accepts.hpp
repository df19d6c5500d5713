// What a peer would import, and what of this side was compared with that so far.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

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
  // What costs no more is compared at once, and nothing is kept of that. Roughly in bytes that are
  // looked at: of the patterns, and for each of them that has a star of the name as well.
  static constexpr std::uint64_t kSmall = 4096;

  // What is remembered of comparisons counts in `memory`; null: nowhere. It outlives this.
  explicit PeerAccepts(Accepts told, Budget* memory = nullptr);

  [[nodiscard]] const Accepts& told() const { return told_; }

  // Whether the peer would take it; nullopt: that is not known yet, and noted.
  [[nodiscard]] std::optional<bool> takes(const Interface& what) const;
  // Something is noted.
  [[nodiscard]] bool lacks() const { return !noted_.empty(); }
  // Compares the first that is noted. Returns what that has cost.
  std::uint64_t compare();
  // It is not to be compared before; for AcceptsReview.
  void rest_until(TimePoint until) { rests_until_ = until; }
  [[nodiscard]] TimePoint rests_until() const { return rests_until_; }

 private:
  struct Noted {
    InterfaceKind kind = InterfaceKind::kTopic;
    std::string name, type, action_type, node;
  };

  void count(const std::vector<std::string>& patterns);
  [[nodiscard]] std::uint64_t cost_of(const Interface& what) const;

  Accepts told_;
  std::uint64_t text_cost_ = 0;  // of all patterns
  std::uint64_t with_stars_ = 0;
  TimePoint rests_until_{};
  // By the interface; without a value it is noted.
  mutable std::unordered_map<std::string, std::optional<bool>> known_;
  mutable std::deque<Noted> noted_;
  Budget* memory_;
  mutable Budget::Hold held_;  // for both
};

}  // namespace connect_bridge
