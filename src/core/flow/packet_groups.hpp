// Packets of videos that refer to each other, of all publishers of a channel.
#pragma once

#include <cstdint>
#include <unordered_map>

#include "core/base/ids.hpp"
#include "core/flow/out_message.hpp"

namespace connect_bridge {

// A packet that refers to one that did not leave cannot be decoded: neither can those behind it, up
// to the next key frame. Wherever a packet was lost, its place in the order is empty. Belongs to a
// channel's queue; single-threaded.
class PacketGroups {
 public:
  // Is the next packet of its origin of no use? Then it is dropped.
  [[nodiscard]] bool misses(const OutMessage& message) {
    if (message.video != VideoPart::kRefers || message.order == 0) return false;
    Stream& stream = streams_[message.subject.origin()];  // a new one lacks all before it
    if (stream.last + 1 == message.order) return false;
    // Without key frames pictures are renewed in parts, and whole again after some time.
    return ++stream.skipped <= kSkippedMax;  // mutant: packets_of_lost_ones
  }
  void left(const OutMessage& message) {
    const auto known = streams_.find(message.subject.origin());
    if (message.video != VideoPart::kNone) {
      streams_[message.subject.origin()] = {message.order, 0};
    } else if (known != streams_.end() && known->second.last + 1 == message.order) {
      ++known->second.last;  // parameters alone, which no picture refers to as one
    }
  }
  void forget(OriginId origin) { streams_.erase(origin); }

  static constexpr std::uint32_t kSkippedMax = 300;  // ten seconds of 30 a second

 private:
  struct Stream {
    std::uint64_t last = 0;  // order of the message that left
    std::uint32_t skipped = 0;
  };
  std::unordered_map<OriginId, Stream> streams_;
};

}  // namespace connect_bridge
