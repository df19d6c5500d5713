// Messages that were sent, and whose arrival at the peer is tracked.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "core/base/ids.hpp"
#include "core/flow/channel_queue.hpp"

namespace connect_bridge {

// In the order in which they left; bounded by the window. Bytes are those of a connection's binary
// packets. Belongs to an Outbox.
class InFlight {
 public:
  struct Message {
    ChannelId channel;
    ChannelQueue::Whole whole;
  };

  // The last part of the message is in the packet that is being gathered.
  void add(Message message) {
    messages_.push_back({0, message});
    ++gathered_;
  }
  // The packet being gathered ends at this count of sent bytes.
  void packet_ends(std::uint64_t at) {
    for (; gathered_ > 0; --gathered_) messages_[messages_.size() - gathered_].end = at;
  }
  // The next message that has arrived completely, given that the peer has received so many bytes;
  // nullopt: no further one.
  [[nodiscard]] std::optional<Message> take_arrived(std::uint64_t received_bytes) {
    if (messages_.size() == gathered_ || messages_.front().end > received_bytes)
      return std::nullopt;
    const Message arrived = messages_.front().message;
    messages_.pop_front();
    return arrived;
  }

 private:
  struct Sent {
    std::uint64_t end = 0;  // bytes sent up to its end
    Message message;
  };
  std::deque<Sent> messages_;
  std::size_t gathered_ = 0;  // the last of them, whose packet has not ended
};

}  // namespace connect_bridge
