// Sent messages of one channel that may not have arrived and are to be sent again on the next
// connection.
#pragma once

#include <cstdint>
#include <deque>
#include <utility>

#include "core/flow/out_message.hpp"

namespace connect_bridge {

// In the order in which it was sent. Single-threaded.
class SentMessages {
 public:
  struct Sent {
    OutMessage message;     // as it would be sent again
    std::size_t bytes = 0;  // of its body as it left
  };

  void add(OutMessage message, std::size_t bytes) {
    bytes_ += kept_bytes_of(message);
    sent_.push_back({std::move(message), bytes});
  }
  // The peer has all of this message.
  void arrived(std::uint32_t sequence) {
    if (sent_.empty() || sent_.front().message.sequence != sequence) return;
    bytes_ -= kept_bytes_of(sent_.front().message);
    sent_.pop_front();
  }
  void clear() { static_cast<void>(take()); }
  // Bodies, and kKeptMessageBytes for each.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  // Returns all; empty afterwards.
  std::deque<Sent> take() {
    bytes_ = 0;
    return std::exchange(sent_, {});
  }

 private:
  std::deque<Sent> sent_;
  std::uint64_t bytes_ = 0;
};

}  // namespace connect_bridge
