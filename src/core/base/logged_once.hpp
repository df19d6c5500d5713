// Limits log lines to one for each cause, however often the cause occurs.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <unordered_set>

#include "core/base/time.hpp"

namespace connect_bridge {

// Bounded, as a peer must not be able to fill the memory or the log. When it is full, nothing new
// is logged for a while; then it starts with an empty table, because otherwise a peer with many
// names could silence all later lines.
class LoggedOnce {
 public:
  static constexpr std::size_t kLoggedMax = 256;
  static constexpr Duration kFullTime = std::chrono::minutes(15);

  // Whether this is the first time, so that it is to be logged now.
  [[nodiscard]] bool first(const std::string& what) {
    return logged_.size() < kLoggedMax && logged_.insert(what).second;
  }
  // To be called from time to time.
  void on_time(const Now& now) {
    if (logged_.size() < kLoggedMax) return;
    if (!full_until_) full_until_ = now.steady + kFullTime;
    if (now.steady < *full_until_) return;
    full_until_.reset();
    logged_.clear();
  }

 private:
  std::unordered_set<std::string> logged_;
  std::optional<TimePoint> full_until_;
};

}  // namespace connect_bridge
