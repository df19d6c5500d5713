// Work that is done once an input is handled.
#pragma once

#include <bit>
#include <cstdint>
#include <optional>

namespace connect_bridge {

// In the order in which they are done.
enum class FollowUp : std::uint8_t {
  kRights,   // rules or identities are new: what they allow is decided again
  kDemands,  // demands are to be sent to peers
  kActions,  // peers use an action, or do not any longer
  kOffers,   // something is to be offered (again)
  kWheels,   // a robot has told who steers
  kClock,    // whether the graph's clock is to be followed may have changed
  kClaim,    // what this bridge mirrors has changed
};

// Whoever causes one adds it, so that nobody is asked who has nothing to say, and what many cause
// is done once. Single-threaded.
class FollowUps {
 public:
  void add(FollowUp what) { added_ |= bit(what); }
  // Takes the first one, if it is not behind `last`.
  std::optional<FollowUp> take(FollowUp last) {
    const auto first = static_cast<FollowUp>(std::countr_zero(added_));
    if (added_ == 0 || first > last) return std::nullopt;
    added_ &= ~bit(first);
    return first;
  }

 private:
  static constexpr unsigned bit(FollowUp what) { return 1U << static_cast<unsigned>(what); }

  unsigned added_ = 0;
};

}  // namespace connect_bridge
