// How large a part may be so that the next urgent message need not wait long behind it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge {

// A part takes about kPartTime on the wire: the rate at which the peer acknowledges tells its size.
// Without a measurement there is no limit but the options'. It only sizes parts; it paces nothing.
class PartSize {
 public:
  static constexpr Duration kPartTime = std::chrono::milliseconds(5);
  static constexpr std::uint64_t kPartBytesMin = 1024;

  // Packet bytes leave. `idle`: nothing was unacknowledged before.
  void sent(bool idle, TimePoint now) {
    if (idle) since_ = now;
  }

  // The peer acknowledged `bytes` more. `backlogged`: more waited to be sent all the time, so that
  // the link and not the traffic made the rate.
  void acknowledged(std::uint64_t bytes, bool backlogged, TimePoint now) {
    const Duration took = since_ ? now - *since_ : Duration::zero();
    since_ = now;
    if (!backlogged || took <= Duration::zero()) return;
    rates_[next_] = static_cast<double>(bytes) / static_cast<double>(took.count());
    next_ = (next_ + 1) % rates_.size();
  }

  // At most `limit`.
  [[nodiscard]] std::uint32_t bytes(std::uint32_t limit) const {
    // The fastest of the last intervals: others were held up by something else than the link.
    const double rate = *std::max_element(rates_.begin(), rates_.end());
    if (rate == 0) return limit;
    const double size = rate * static_cast<double>(kPartTime.count());
    if (size >= limit) return limit;
    return std::min(limit,
                    static_cast<std::uint32_t>(std::max(size, static_cast<double>(kPartBytesMin))));
  }

 private:
  std::array<double, 8> rates_{};  // bytes per nanosecond; 0: none
  std::size_t next_ = 0;
  std::optional<TimePoint> since_;
};

}  // namespace connect_bridge
