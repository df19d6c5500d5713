// The offset between the peer's system clock and ours, from four stamps and a minimum filter.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/base/time.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge {

// Estimates the offset of the peer's clock. Uses the recent sample with the shortest round trip,
// because queues only add delay (RFC 5905 section 10, clock filter). Belongs to one link.
class ClockEstimate {
 public:
  struct Sample {
    Duration offset{0};
    Duration round_trip{0};
    Stamp at = 0;  // by our clock
  };

  // Adds a sample. `t4`: our system clock at the reply's arrival, in ns. Replies with impossible
  // stamps are ignored.
  void add(const TimeReply& reply, Stamp t4) {
    if (!is_plausible(reply.t1) || !is_plausible(reply.t2) || !is_plausible(reply.t3)) return;
    if (reply.t3 < reply.t2 || t4 < reply.t1) return;
    const Stamp round_trip = (t4 - reply.t1) - (reply.t3 - reply.t2);
    if (round_trip < 0) return;
    const Stamp offset = ((reply.t2 - reply.t1) + (reply.t3 - t4)) / 2;  // mutant: clock_offset
    const Sample sample{Duration(offset), Duration(round_trip), t4};
    // The true offset is within half a round trip of each sample. If both cannot be true, one clock
    // was set between them, and earlier samples are of no use.
    if (known() && !agree(best(), sample)) count_ = next_ = 0;
    samples_[next_] = last_ = sample;
    ++total_;
    next_ = (next_ + 1) % kSamples;
    count_ = std::min(count_ + 1, kSamples);
  }

  [[nodiscard]] bool known() const { return count_ > 0; }
  // Peer's system clock minus ours, of the best sample.
  [[nodiscard]] Duration offset() const { return best().offset; }
  [[nodiscard]] Duration round_trip() const { return best().round_trip; }
  // The offset is true within this bound, unless a clock was set since the last reply.
  [[nodiscard]] Duration error_bound() const { return (round_trip() + Duration(1)) / 2; }
  // The last sample, and the number of samples.
  [[nodiscard]] const Sample& last() const { return last_; }
  [[nodiscard]] std::uint64_t total() const { return total_; }

 private:
  // NTP adjusts a clock by at most this rate (500 ppm each, for two clocks).
  static constexpr std::int64_t kDriftPerSecond = 1'000'000;

  // Are both samples possible without a change of one of the clocks?
  [[nodiscard]] static bool agree(const Sample& a, const Sample& b) {
    const Duration drift(std::abs(b.at - a.at) / std::nano::den * kDriftPerSecond);
    const Duration apart = a.offset > b.offset ? a.offset - b.offset : b.offset - a.offset;
    return apart <= (a.round_trip + b.round_trip) / 2 + drift + std::chrono::milliseconds(1);
  }
  [[nodiscard]] const Sample& best() const {
    return *std::min_element(
        samples_.begin(),
        samples_.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(count_, 1)),
        [](const Sample& a, const Sample& b) { return a.round_trip < b.round_trip; });
  }

  static constexpr std::size_t kSamples = 16;
  std::array<Sample, kSamples> samples_{};
  std::size_t count_ = 0;
  std::size_t next_ = 0;
  Sample last_;
  std::uint64_t total_ = 0;
};

}  // namespace connect_bridge
