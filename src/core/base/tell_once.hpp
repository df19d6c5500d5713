// Lines that are worth being logged once, however often their cause comes back.
#pragma once

#include <cstddef>
#include <string>
#include <unordered_set>

namespace connect_bridge {

// Bounded: what a peer can cause must not fill the memory, nor the log. When it is full, nothing
// new is told.
class TellOnce {
 public:
  static constexpr std::size_t kToldMax = 1024;

  // Whether this is to be told now: the first time.
  [[nodiscard]] bool first(const std::string& what) {
    return told_.size() < kToldMax && told_.insert(what).second;
  }

 private:
  std::unordered_set<std::string> told_;
};

}  // namespace connect_bridge
