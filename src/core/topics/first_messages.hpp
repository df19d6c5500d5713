// Messages for a mirror that no subscriber can receive yet.
#pragma once

#include <cstddef>
#include <deque>

#include "core/base/budget.hpp"
#include "core/base/bytes.hpp"
#include "core/base/timers.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

class Mirror;
class OfferedTopic;

// They wait until the mirror exists (its origin's node may have no name yet), and then until the
// subscribers here have found it: they would not receive what is published before that. `feeder`
// offers the mirror's origin and counts what is lost after all; null: no link offers it now.
// Single-threaded.
class FirstMessages {
 public:
  // Sets when the subscribers have found the mirror.
  void wait(Timers<Mirror*>::Timer until) { until_ = std::move(until); }
  [[nodiscard]] bool waits() const { return bool(until_); }
  [[nodiscard]] bool empty() const { return messages_.empty(); }
  // Whether one more fits without displacing others.
  [[nodiscard]] bool fits(std::size_t bytes) const {
    return messages_.size() < kMessagesMax && bytes_ + bytes <= kBytesMax;
  }
  // Keeps it, and drops the oldest if need be. False: it is too large, or must not be late.
  bool keep(const Payload& raw, OfferedTopic* feeder);
  // From now on they count in the budget of the feeder's link.
  void draw_from(Budget* memory) { held_ = memory ? memory->hold(bytes_) : Budget::Hold(); }
  // Whether the time to publish them has come; then later ones need not wait.
  [[nodiscard]] bool are_due(const Now& now);
  // Publishes all of them, in order.
  void publish(Outputs& outputs, MirrorId mirror);
  void drop(OfferedTopic* feeder);

 private:
  // A peer can have thousands of mirrors that wait.
  static constexpr std::size_t kMessagesMax = 100;
  static constexpr std::size_t kBytesMax = 32 << 10;

  std::deque<Payload> take();

  Timers<Mirror*>::Timer until_;
  std::deque<Payload> messages_;
  std::size_t bytes_ = 0;
  Budget::Hold held_;
};

}  // namespace connect_bridge
