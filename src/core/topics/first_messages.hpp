// What comes for a mirror that nobody can hear yet.
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

// They wait for the mirror itself, whose origin's node has no name yet, and then for the
// subscribers here to find it: what is published before that is lost to them. `feeder` is who
// offers the mirror's origin and counts what is lost after all; null: nobody does now.
// Single-threaded.
class FirstMessages {
 public:
  // The subscribers have found the mirror by then.
  void wait(Timers<Mirror*>::Timer until) { until_ = std::move(until); }
  [[nodiscard]] bool waits() const { return bool(until_); }
  [[nodiscard]] bool empty() const { return messages_.empty(); }
  // Whether one more displaces none.
  [[nodiscard]] bool fits(std::size_t bytes) const {
    return messages_.size() < kMessagesMax && bytes_ + bytes <= kBytesMax;
  }
  // Keeps the newest. False: this one is too large to wait, or must not be late.
  bool keep(const Payload& raw, OfferedTopic* feeder);
  // They are of what the feeder's link may hold from now on.
  void draw_from(Budget* memory) { held_ = memory ? memory->hold(bytes_) : Budget::Hold(); }
  // Whether the time has come; then nothing waits any longer.
  [[nodiscard]] bool are_due(const Now& now);
  // All of them, in order.
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
