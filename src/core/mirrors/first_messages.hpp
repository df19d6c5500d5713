// Messages for a mirror that no subscriber can receive yet.
#pragma once

#include <cstddef>
#include <deque>

#include "core/base/budget.hpp"
#include "core/base/bytes.hpp"
#include "core/base/timers.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

class TopicMirror;
class PeerTopic;

// Messages wait until the mirror exists (its origin's node may have no name yet). Then they wait
// until the subscribers here have found it, because these would miss earlier messages. A message
// with a `max_age` leaves before it is too old, together with the older ones. A message that is too
// old already is lost. `feeder`: the peer topic that offers the mirror's origin; it counts lost
// messages. Null: no link offers the origin now. Single-threaded.
class FirstMessages {
 public:
  explicit FirstMessages(Timers<TopicMirror*>::Of timers) : timers_(timers) {}

  // The mirror exists now, and the subscribers will have found it at `found`. The deadline is
  // `found`, or earlier if a message cannot wait so long.
  void wait(TimePoint found);
  [[nodiscard]] bool waits() const { return bool(due_); }
  [[nodiscard]] bool empty() const { return messages_.empty(); }
  // Whether one more message fits without displacing others.
  [[nodiscard]] bool fits(std::size_t bytes) const {
    return messages_.size() < kMessagesMax && bytes_ + bytes <= kBytesMax;
  }
  // Keeps the message, and drops the oldest ones if there is no room. False: no link feeds the
  // mirror, or the message is too large.
  bool keep(const Payload& raw, TimePoint expires, PeerTopic* feeder);
  // From now on the messages count in the budget of the feeder's link.
  void draw_from(Budget* memory) { held_ = memory ? memory->hold(bytes_) : Budget::Hold(); }
  // Publishes due messages in order. At `found` all of them are due, and later ones need not wait.
  void publish_due(Outputs& outputs, MirrorId mirror, PeerTopic* feeder, const Now& now);
  // Publishes all of them, in order.
  void publish(Outputs& outputs, MirrorId mirror, PeerTopic* feeder, const Now& now);
  // Drops all messages. Later ones still wait.
  void drop(PeerTopic* feeder);
  // The mirror is gone: the deadline is cancelled.
  void end_wait() { due_.cancel(); }

 private:
  // A peer can have thousands of mirrors that wait.
  static constexpr std::size_t kMessagesMax = 100;
  static constexpr std::size_t kBytesMax = 32 << 10;

  struct Waiting {
    Payload raw;
    TimePoint expires;
    [[nodiscard]] TimePoint leaves() const;
  };

  void set_due();
  Payload take();
  void publish_first(std::ptrdiff_t count, Outputs& outputs, MirrorId mirror, PeerTopic* feeder,
                     const Now& now);

  Timers<TopicMirror*>::Of timers_;
  TimePoint found_{};  // of the last wait()
  Timers<TopicMirror*>::Timer due_;
  std::deque<Waiting> messages_;
  std::size_t bytes_ = 0;
  Budget::Hold held_;
};

}  // namespace connect_bridge
