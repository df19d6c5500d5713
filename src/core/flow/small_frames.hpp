// The frames that overtake all data on a connection: acknowledgements, time frames, aborts.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <optional>
#include <variant>
#include <vector>

#include "core/base/check.hpp"
#include "core/base/ids.hpp"
#include "core/flow/packet.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge {

// Time frames that wait; a newer one displaces the oldest (a peer may ask faster than it reads).
inline constexpr std::size_t kTimeFramesMax = 16;
// Aborts in one packet: a part of the frames that it may have (kPacketFramesMax).
inline constexpr std::size_t kPacketAbortsMax = 512;

// Belongs to an Outbox.
class SmallFrames {
 public:
  // Queues an ack or time frame; a newer ack replaces an older one.
  void push(const Frame& frame) {
    if (std::holds_alternative<AckFrame>(frame)) {
      ack_ = frame;
      return;
    }
    CONNECT_CHECK(std::holds_alternative<TimeRequest>(frame) ||
                  std::holds_alternative<TimeReply>(frame));
    if (times_.size() == kTimeFramesMax) times_.pop_front();
    times_.push_back(frame);
  }
  // The channel's open message ends unfinished.
  void abort(ChannelId channel) { aborts_.push_back(channel); }
  // The channel has ended.
  void forget(ChannelId channel) { std::erase(aborts_, channel); }

  // Whether an ack or time frame does.
  [[nodiscard]] bool waits() const { return ack_ || !times_.empty(); }
  // Aborts wait for the next packet, and data behind them: they must leave before their channel's
  // next message.
  [[nodiscard]] bool aborts_wait() const { return !aborts_.empty(); }
  // Moves them into the packet, of aborts as many as it may have.
  void leave(PacketBuilder& packet) {
    if (ack_) packet.add(*ack_);
    for (const auto& frame : times_) packet.add(frame);
    ack_.reset();
    times_.clear();
    const auto count = std::min(aborts_.size(), kPacketAbortsMax);
    for (std::size_t i = 0; i < count; ++i) packet.add(PartFrame{aborts_[i], true, {}});
    aborts_.erase(aborts_.begin(), aborts_.begin() + static_cast<std::ptrdiff_t>(count));
  }

 private:
  std::optional<Frame> ack_;
  std::deque<Frame> times_;
  std::vector<ChannelId> aborts_;
};

}  // namespace connect_bridge
