#include "core/link/clock_estimate.hpp"

#include <algorithm>
#include <cstdlib>

namespace connect_bridge {
namespace {

// NTP adjusts a clock by at most this rate (500 ppm each, for two clocks).
constexpr std::int64_t kDriftPerSecond = 1'000'000;

}  // namespace

void ClockEstimate::add(const TimeReply& reply, Stamp t4) {
  if (!is_plausible(reply.t1) || !is_plausible(reply.t2) || !is_plausible(reply.t3)) return;
  if (reply.t3 < reply.t2 || t4 < reply.t1) return;
  const Stamp round_trip = (t4 - reply.t1) - (reply.t3 - reply.t2);
  if (round_trip < 0) return;
  const Stamp offset = ((reply.t2 - reply.t1) + (reply.t3 - t4)) / 2;  // mutant: clock_offset
  const Sample sample{Duration(offset), Duration(round_trip), t4};
  // The true offset is within half a round trip of each sample. If that cannot be, one of the
  // clocks was set between the two, and what was measured before is of no use.
  if (known() && !agree(best(), sample)) count_ = next_ = 0;
  samples_[next_] = last_ = sample;
  ++total_;
  next_ = (next_ + 1) % kSamples;
  count_ = std::min(count_ + 1, kSamples);
}

bool ClockEstimate::agree(const Sample& a, const Sample& b) {
  const Duration drift(std::abs(b.at - a.at) / std::nano::den * kDriftPerSecond);
  const Duration apart = a.offset > b.offset ? a.offset - b.offset : b.offset - a.offset;
  return apart <= (a.round_trip + b.round_trip) / 2 + drift + std::chrono::milliseconds(1);
}

const ClockEstimate::Sample& ClockEstimate::best() const {
  return *std::min_element(
      samples_.begin(),
      samples_.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(count_, 1)),
      [](const Sample& a, const Sample& b) { return a.round_trip < b.round_trip; });
}

}  // namespace connect_bridge
