// Limits log lines that a peer or a caller can cause as often as it likes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/base/pace.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// Where one line as an example is enough: one per period, with a count.
class LogLimit {
 public:
  static constexpr Duration kPeriod = std::chrono::seconds(10);

  // Counts one more. Returns how many there were since the last line, if it is time for the next
  // one.
  std::optional<std::uint64_t> count(const Now& now) {
    ++count_;
    if (next_ && now.steady < *next_) return std::nullopt;
    next_ = now.steady + kPeriod;
    return std::exchange(count_, 0);
  }

 private:
  std::optional<TimePoint> next_;
  std::uint64_t count_ = 0;
};

// Where each of the first lines matters: some at once, then one per period.
class LinePace {
 public:
  // Counts one more. Returns the text that the line ends with (how many lines were left out), or
  // nullopt if the line is not to be written.
  std::optional<std::string> take(const Now& now) {
    if (!pace_.take(now.steady)) {
      ++left_out_;
      return std::nullopt;
    }
    const std::uint64_t count = std::exchange(left_out_, 0);
    return count == 0 ? "" : "; " + std::to_string(count) + " lines like this were left out";
  }

 private:
  Pace pace_{30, std::chrono::seconds(5)};
  std::uint64_t left_out_ = 0;
};

}  // namespace connect_bridge
