// When to tell the peer how many packet bytes have arrived (docs/protocol.md, "Acknowledgements").
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge {

// Belongs to one connection. An acknowledgement is due after kAckBytesDue unacknowledged bytes or
// kAckDelay after the first of them; packets that hold nothing but acks and time frames count but
// start no timer.
class Acknowledger {
 public:
  static constexpr std::uint64_t kAckBytesDue = 65536;
  static constexpr Duration kAckDelay = std::chrono::milliseconds(100);

  void on_packet(std::size_t bytes, bool holds_data, TimePoint now) {
    received_ += bytes;
    if (holds_data && !due_at_) due_at_ = now + kAckDelay;
    // All bytes count against the sender's window, so that acks and time frames must be
    // acknowledged at last, too; one ack for so many of them makes no ping-pong.
    if (received_ - acknowledged_ >= kAckBytesDue) due_at_ = now;
  }

  // The count to send, if an acknowledgement is due.
  std::optional<std::uint64_t> take_due(TimePoint now) {
    if (!due_at_ || *due_at_ > now) return std::nullopt;
    due_at_.reset();
    acknowledged_ = received_;
    return received_;
  }

  [[nodiscard]] std::optional<TimePoint> deadline() const { return due_at_; }
  [[nodiscard]] std::uint64_t received_bytes() const { return received_; }

 private:
  std::uint64_t received_ = 0;
  std::uint64_t acknowledged_ = 0;
  std::optional<TimePoint> due_at_;
};

}  // namespace connect_bridge
