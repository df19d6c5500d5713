// The words of clients that have logged in (login_word()).
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <unordered_map>

#include "core/base/pace.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// A client that shows a word has handshakes of its own, at a pace: everybody on the path can read a
// word that was shown, and show it, too. Bounded in memory: the oldest word goes, first of its own
// address. Single-threaded.
class LoginWords {
 public:
  static constexpr std::size_t kWordsMax = 1024;
  static constexpr std::size_t kOfAddressMax = 64;
  static constexpr int kAtOnce = 10;
  static constexpr Duration kPeriod = std::chrono::seconds(1);

  void add(const std::string& word, const std::string& address, TimePoint now) {
    if (word.empty()) return;
    const auto of_address = [&](const auto& known) { return known.second.address == address; };
    if (std::count_if(words_.begin(), words_.end(), of_address) >=
        static_cast<std::ptrdiff_t>(kOfAddressMax))
      drop_oldest(of_address);
    else if (words_.size() >= kWordsMax)
      drop_oldest([](const auto&) { return true; });
    words_.insert_or_assign(word, Known{address, now, Pace(kAtOnce, kPeriod)});
  }
  // Whether the word is known and does not come too often; then it counts.
  [[nodiscard]] bool take(const std::string& word, TimePoint now) {
    const auto found = words_.find(word);
    return found != words_.end() && found->second.pace.take(now);
  }
  [[nodiscard]] bool empty() const { return words_.empty(); }

 private:
  struct Known {
    std::string address;
    TimePoint since;
    Pace pace;
  };

  template <class Which>
  void drop_oldest(const Which& which) {
    auto oldest = words_.end();
    for (auto it = words_.begin(); it != words_.end(); ++it)
      if (which(*it) && (oldest == words_.end() || it->second.since < oldest->second.since))
        oldest = it;
    if (oldest != words_.end()) words_.erase(oldest);
  }

  std::unordered_map<std::string, Known> words_;
};

}  // namespace connect_bridge
