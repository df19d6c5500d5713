// What comes for a mirror that nobody can hear yet.
#pragma once

#include <cstddef>
#include <deque>
#include <utility>

#include "core/base/bytes.hpp"
#include "core/base/timers.hpp"

namespace connect_bridge {

class Mirror;

// They wait for the mirror itself, whose origin's node has no name yet, and then for the
// subscribers here to find it: what is published before that is lost to them. Single-threaded.
class FirstMessages {
 public:
  // The subscribers have found the mirror by then.
  void wait(Timers<Mirror*>::Timer until) { until_ = std::move(until); }
  [[nodiscard]] bool waits() const { return bool(until_); }
  [[nodiscard]] bool empty() const { return messages_.empty(); }
  // Keeps the newest. False: it is too large to wait.
  bool keep(const Payload& raw) {
    if (raw.size() > kBytesMax) return false;
    bytes_ += raw.size();
    messages_.push_back(raw);
    while (messages_.size() > kMessagesMax || bytes_ > kBytesMax) {
      bytes_ -= messages_.front().size();
      messages_.pop_front();
    }
    return true;
  }
  std::deque<Payload> take() {
    bytes_ = 0;
    return std::exchange(messages_, {});
  }
  // The same when the time has come; then nothing waits any longer.
  std::deque<Payload> take_due(const Now& now) {
    if (!until_ || until_.at() > now.steady) return {};
    until_.cancel();
    return take();
  }
  void drop() { take(); }
  void clear() {
    until_.cancel();
    drop();
  }

 private:
  // A peer can have thousands of mirrors that wait.
  static constexpr std::size_t kMessagesMax = 100;
  static constexpr std::size_t kBytesMax = 32 << 10;

  Timers<Mirror*>::Timer until_;
  std::deque<Payload> messages_;
  std::size_t bytes_ = 0;
};

}  // namespace connect_bridge
