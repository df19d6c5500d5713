// When to tell the peer how many packet bytes have arrived (docs/protocol.md, "Acknowledgements").
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge {

// Belongs to one connection. An acknowledgement is due after kAckBytesDue unacknowledged bytes, but
// on a fast link not more often than every kAckPause (each costs both sides a wake-up, in the
// middle of a message), and at once after kAckBytesMax; and it is due kAckDelay after the first of
// the bytes. Packets that hold nothing but acks and time frames count but start no timer.
class Acknowledger {
 public:
  static constexpr std::uint64_t kAckBytesDue = 65536;
  static constexpr std::uint64_t kAckBytesMax = 1 << 20;
  static constexpr Duration kAckPause = std::chrono::milliseconds(5);
  static constexpr Duration kAckDelay = std::chrono::milliseconds(100);

  void on_packet(std::size_t bytes, bool holds_data, TimePoint now) {
    received_ += bytes;
    if (holds_data && !due_at_) due_at_ = now + kAckDelay;
    // All bytes count against the sender's window, so that acks and time frames must be
    // acknowledged at last, too; one ack for so many of them makes no ping-pong.
    const std::uint64_t open = received_ - acknowledged_;
    if (open >= kAckBytesMax || (open >= kAckBytesDue && !last_at_)) {
      due_at_ = now;
    } else if (open >= kAckBytesDue) {
      due_at_ = std::min(due_at_.value_or(now + kAckDelay), std::max(now, *last_at_ + kAckPause));
    }
  }

  // The count to send, if an acknowledgement is due.
  std::optional<std::uint64_t> take_due(TimePoint now) {
    if (!due_at_ || *due_at_ > now) return std::nullopt;
    due_at_.reset();
    last_at_ = now;
    acknowledged_ = received_;
    return received_;
  }

  [[nodiscard]] std::optional<TimePoint> deadline() const { return due_at_; }
  [[nodiscard]] std::uint64_t received_bytes() const { return received_; }

 private:
  std::uint64_t received_ = 0;
  std::uint64_t acknowledged_ = 0;
  std::optional<TimePoint> due_at_;
  std::optional<TimePoint> last_at_;  // when the last one was taken
};

}  // namespace connect_bridge
