// How many bytes of control messages the links of one identity may send.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "core/base/ids.hpp"
#include "core/flow/rate_limit.hpp"

namespace connect_bridge {

// All of them together may send what 8 seconds allow at once, then so many bytes a second. When
// that is used up, the link that has sent most of it ends, not the one that speaks next: another
// one that said little goes on. Reconnecting gains nothing: what a link has sent counts on
// when it is gone, but for a second's worth for each that is ended. Single-threaded.
class TextLimit {
 public:
  static constexpr Duration kAtOnce = std::chrono::seconds(8);

  // In bytes a second.
  explicit TextLimit(double per_second) : per_second_(per_second), throttle_(per_second, kAtOnce) {}

  // Whether a message of this link may pass now; then it counts. False: the link is to end. True
  // may mean that another link is to end, see take_loudest().
  [[nodiscard]] bool take(LinkId link, std::size_t bytes, TimePoint now) {
    if (throttle_.ready_at() == TimePoint::min() || throttle_.ready_at() + kAtOnce <= now)
      sent_.clear();  // all is paid off
    if (!throttle_.ready(now)) {
      const auto most =
          std::max_element(sent_.begin(), sent_.end(),
                           [](const auto& a, const auto& b) { return a.second < b.second; });
      if (most == sent_.end() || most->first == link || most->second < per_second_) return false;
      loudest_ = most->first;
      sent_.erase(most);
      throttle_.take(-per_second_, now);
    }
    const auto amount = static_cast<double>(bytes);
    throttle_.take(amount, now);
    sent_[link] += amount;
    return true;
  }
  // The link that ends for what another one was let through; once after each time.
  [[nodiscard]] std::optional<LinkId> take_loudest() {
    return std::exchange(loudest_, std::nullopt);
  }
  // The link has no connection any more.
  void forget(LinkId link) { sent_.erase(link); }

 private:
  double per_second_;
  Throttle throttle_;
  std::map<LinkId, double> sent_;  // since all was paid off; of those that are open
  std::optional<LinkId> loudest_;
};

}  // namespace connect_bridge
