// Limits log lines that a peer or a caller can cause as often as it likes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/base/pace.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// Some lines at once, then one per period, each with the number of those that it stands for.
class LogLimit {
 public:
  LogLimit() : LogLimit(1, std::chrono::seconds(10)) {}  // one line is enough as an example
  LogLimit(int at_once, Duration period) : pace_(at_once, period) {}

  // Counts one more, or several. Returns how many there were since the last line, these among them;
  // nullopt: it is not to be written.
  std::optional<std::uint64_t> count(const Now& now, std::uint64_t more = 1) {
    count_ += more;
    if (!pace_.take(now.steady)) return std::nullopt;
    return std::exchange(count_, 0);
  }

 private:
  Pace pace_;
  std::uint64_t count_ = 0;
};

// The end of a line that stands for so many: how many were left out.
[[nodiscard]] inline std::string left_out(std::uint64_t count) {
  return count <= 1 ? "" : "; " + std::to_string(count - 1) + " lines like this were left out";
}

}  // namespace connect_bridge
