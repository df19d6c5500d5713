// Lines that a peer can cause as often as it likes, and of which each of the first ones matters.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/base/pace.hpp"

namespace connect_bridge {

// Some at once, then one now and then. Where only a sample matters LogLimit does.
class LinePace {
 public:
  // One more happened. What the line ends with, if it is to be written: how many were not.
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
