// Addresses from which somebody has logged in lately.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <unordered_map>

#include "core/base/time.hpp"

namespace connect_bridge {

// Bounded in memory: for a new address beyond kAddressesMax the one that logged in first goes.
// Single-threaded.
class RecentLogins {
 public:
  static constexpr Duration kLately = std::chrono::hours(1);
  static constexpr std::size_t kAddressesMax = 1024;

  void add(const std::string& address, TimePoint now) {
    if (address.empty()) return;
    if (last_.size() >= kAddressesMax && !last_.contains(address))
      last_.erase(std::min_element(last_.begin(), last_.end(), [](const auto& a, const auto& b) {
        return a.second < b.second;
      }));
    last_[address] = now;
  }
  [[nodiscard]] bool has(const std::string& address, TimePoint now) const {
    const auto found = last_.find(address);
    return found != last_.end() && now < found->second + kLately;
  }

 private:
  std::unordered_map<std::string, TimePoint> last_;
};

}  // namespace connect_bridge
