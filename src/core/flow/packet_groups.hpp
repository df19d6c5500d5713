// Packets of videos that refer to each other, of all publishers of a channel.
#pragma once

#include <cstdint>
#include <unordered_map>

#include "core/base/ids.hpp"
#include "core/flow/out_message.hpp"

namespace connect_bridge {

// A packet that refers to one that did not leave cannot be decoded: neither can those behind it, up
// to the next key frame. Wherever a packet was lost, its number is missing. Belongs to a channel's
// queue; single-threaded.
class PacketGroups {
 public:
  // Is the next packet of its origin of no use? Then it is dropped.
  [[nodiscard]] bool misses(const OutMessage& message) {
    if (message.video != VideoPart::kRefers || message.number == 0) return false;
    Stream& stream = streams_[message.subject.origin()];  // a new one lacks all before it
    if (stream.last + 1 == message.number) return false;
    // Without key frames pictures are renewed in parts, and whole again after some time.
    return ++stream.skipped <= kSkippedMax;  // mutant: packets_of_lost_ones
  }
  void left(const OutMessage& message) {
    if (message.video != VideoPart::kNone) streams_[message.subject.origin()] = {message.number, 0};
  }

  static constexpr std::uint32_t kSkippedMax = 300;  // ten seconds of 30 a second

 private:
  struct Stream {
    std::uint64_t last = 0;  // number of the packet that left
    std::uint32_t skipped = 0;
  };
  std::unordered_map<OriginId, Stream> streams_;
};

}  // namespace connect_bridge
