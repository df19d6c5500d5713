// The time to send the peer an acknowledgement of the bytes that have arrived (docs/protocol.md,
// "Acknowledgements").
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge {

// Belongs to one connection. The sender decides: an acknowledgement is due at once when a packet
// requests one. Otherwise it is due kAckDelay after the first unacknowledged data. It is due at
// once after kAckBytesMax bytes of any kind, since all of them count against the sender's window.
class Acknowledger {
 public:
  static constexpr std::uint64_t kAckBytesMax = 1 << 20;
  static constexpr Duration kAckDelay = std::chrono::milliseconds(100);

  struct Contents {
    bool data = false;  // the packet holds more than acks and time frames
    bool asks = false;  // the packet requests an acknowledgement
  };
  void on_packet(std::size_t bytes, Contents contents, TimePoint now) {
    received_ += bytes;
    arrived_ = now;
    if (contents.asks || received_ - acknowledged_ >= kAckBytesMax) {
      due_at_ = now;
    } else if (contents.data && !due_at_) {
      due_at_ = now + kAckDelay;
    }
  }

  // The acknowledgement to send, if one is due.
  std::optional<AckFrame> take_due(TimePoint now) {
    if (!due_at_ || *due_at_ > now) return std::nullopt;
    due_at_.reset();
    acknowledged_ = received_;
    return AckFrame{received_, arrived_.time_since_epoch().count()};
  }

  [[nodiscard]] std::optional<TimePoint> deadline() const { return due_at_; }
  [[nodiscard]] std::uint64_t received_bytes() const { return received_; }

 private:
  std::uint64_t received_ = 0;
  std::uint64_t acknowledged_ = 0;
  TimePoint arrived_{};
  std::optional<TimePoint> due_at_;
};

}  // namespace connect_bridge
