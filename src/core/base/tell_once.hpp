// Lines that are worth being logged once, however often their cause comes back.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <unordered_set>

#include "core/base/time.hpp"

namespace connect_bridge {

// Bounded: what a peer can cause must not fill the memory, nor the log. When it is full, nothing
// new is told for a while; then it begins anew, or a peer with odd names would silence all that
// comes later.
class TellOnce {
 public:
  static constexpr std::size_t kToldMax = 1024;
  static constexpr Duration kFullTime = std::chrono::minutes(15);

  // Whether this is to be told now: the first time.
  [[nodiscard]] bool first(const std::string& what) {
    return told_.size() < kToldMax && told_.insert(what).second;
  }
  // To be called now and then.
  void on_time(const Now& now) {
    if (told_.size() < kToldMax) return;
    if (!full_until_) full_until_ = now.steady + kFullTime;
    if (now.steady < *full_until_) return;
    full_until_.reset();
    told_.clear();
  }

 private:
  std::unordered_set<std::string> told_;
  std::optional<TimePoint> full_until_;
};

}  // namespace connect_bridge
