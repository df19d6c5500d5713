#include "core/link/clock_estimate.hpp"

#include <algorithm>

namespace connect_bridge {
void ClockEstimate::add(const TimeReply& reply, Stamp t4) {
  if (!is_plausible(reply.t1) || !is_plausible(reply.t2) || !is_plausible(reply.t3)) return;
  if (reply.t3 < reply.t2 || t4 < reply.t1) return;
  const Stamp round_trip = (t4 - reply.t1) - (reply.t3 - reply.t2);
  if (round_trip < 0) return;
  const Stamp offset = ((reply.t2 - reply.t1) + (reply.t3 - t4)) / 2;
  samples_[next_] = {Duration(offset), Duration(round_trip)};
  next_ = (next_ + 1) % kSamples;
  count_ = std::min(count_ + 1, kSamples);
}

const ClockEstimate::Sample& ClockEstimate::best() const {
  return *std::min_element(
      samples_.begin(),
      samples_.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(count_, 1)),
      [](const Sample& a, const Sample& b) { return a.round_trip < b.round_trip; });
}

}  // namespace connect_bridge
