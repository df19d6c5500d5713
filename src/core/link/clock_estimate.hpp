// The offset between the peer's system clock and ours, from four stamps and a minimum filter.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/time.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge {

// Estimates the offset of the peer's clock. Of the last samples it uses the one with the shortest
// round trip, because queues only add delay (RFC 5905 section 10, clock filter). Belongs to one
// link.
class ClockEstimate {
 public:
  struct Sample {
    Duration offset{0};
    Duration round_trip{0};
    Stamp at = 0;  // by our clock
  };

  // `t4` is our system clock at the reply's arrival. Replies with impossible stamps are ignored.
  void add(const TimeReply& reply, Stamp t4);

  [[nodiscard]] bool known() const { return count_ > 0; }
  // Peer's system clock minus ours, of the best sample.
  [[nodiscard]] Duration offset() const { return best().offset; }
  [[nodiscard]] Duration round_trip() const { return best().round_trip; }
  // The offset is true within this bound, as far as neither clock was set since the last reply.
  [[nodiscard]] Duration error_bound() const { return (round_trip() + Duration(1)) / 2; }
  // The last sample, and how many there were.
  [[nodiscard]] const Sample& last() const { return last_; }
  [[nodiscard]] std::uint64_t total() const { return total_; }

 private:
  // Whether both samples are possible without a change of one of the clocks.
  [[nodiscard]] static bool agree(const Sample& a, const Sample& b);
  [[nodiscard]] const Sample& best() const;

  static constexpr std::size_t kSamples = 16;
  std::array<Sample, kSamples> samples_{};
  std::size_t count_ = 0;
  std::size_t next_ = 0;
  Sample last_;
  std::uint64_t total_ = 0;
};

}  // namespace connect_bridge
