// Rates for unauthenticated connections, each address for itself.
#pragma once

#include <string>
#include <unordered_map>

#include "core/base/pace.hpp"

namespace connect_bridge {

// Bounded in memory: with more than kAddressesMax addresses at a time the later ones are not
// limited here, so the caller limits all together, too.
class AddressPaces {
 public:
  static constexpr std::size_t kAddressesMax = 4096;

  AddressPaces(int at_once, Duration period) : at_once_(at_once), period_(period) {}

  // One more of this address, which may have `share` (>= 1) times what others may. False: it comes
  // too early, and does not count.
  [[nodiscard]] bool take(const std::string& address, int share, TimePoint now) {
    if (paces_.size() >= kAddressesMax) forget_idle(now);
    if (paces_.size() >= kAddressesMax && !paces_.contains(address)) return true;
    return paces_.try_emplace(address, at_once_ * share, period_ / share).first->second.take(now);
  }
  // One that was counted did not happen.
  void give_back(const std::string& address) {
    if (const auto pace = paces_.find(address); pace != paces_.end()) pace->second.give_back();
  }

 private:
  // To look at all of them at each try would cost more than what is limited.
  void forget_idle(TimePoint now) {
    if (now < looks_again_at_) return;
    looks_again_at_ = now + std::chrono::seconds(1);
    std::erase_if(paces_, [&](const auto& entry) { return entry.second.idle(now); });
  }

  int at_once_;
  Duration period_;
  std::unordered_map<std::string, Pace> paces_;
  TimePoint looks_again_at_{};
};

}  // namespace connect_bridge
