// Limits log lines that a peer or a caller can cause as often as it likes: one per period, with a
// count.
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge {

class LogLimit {
 public:
  static constexpr Duration kPeriod = std::chrono::seconds(10);

  // Counts one more. Returns how many there were since the last line, if it is time for the next
  // one.
  std::optional<std::uint64_t> count(const Now& now) {
    ++count_;
    if (next_ && now.steady < *next_) return std::nullopt;
    next_ = now.steady + kPeriod;
    const std::uint64_t counted = count_;
    count_ = 0;
    return counted;
  }

 private:
  std::optional<TimePoint> next_;
  std::uint64_t count_ = 0;
};

}  // namespace connect_bridge
