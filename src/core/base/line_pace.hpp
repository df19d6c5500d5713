// Limits log lines that a peer can cause as often as it likes, where each of the first ones
// matters.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/base/pace.hpp"

namespace connect_bridge {

// Some at once, then one per period. Where one line as an example is enough, use LogLimit.
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
