// Whether the middleware here loses much of a topic, and goes on to.
#pragma once

#include <cstdint>

#include "core/base/time.hpp"

namespace connect_bridge {

// Judged by share and by time: after a burst, or after this side stood still, the middleware
// reports in one moment what it has lost, and that is over. A loss that goes on is reported again
// and again. Belongs to a local topic.
class RecentLoss {
 public:
  void took() { ++taken_; }
  void lost(std::uint64_t count, TimePoint now) {
    if (now - begun_ >= kWindow) {
      taken_ = lost_ = moments_ = 0;
      begun_ = now;
    }
    if (moments_ == 0 || now - moment_ >= kMoment) {
      ++moments_;
      moment_ = now;
    }
    lost_ += count;
    if (moments_ >= kMoments && lost_ >= kLostMin && lost_ * kLostShare >= taken_ + lost_)
      much_until_ = now + kStays;
  }
  // Much of it is lost up to this time, as far as is known now; the past: it is not.
  [[nodiscard]] TimePoint much_until() const { return much_until_; }

 private:
  static constexpr Duration kWindow = std::chrono::seconds(60);
  static constexpr Duration kMoment = std::chrono::seconds(1);
  static constexpr std::uint64_t kMoments = 3;
  static constexpr std::uint64_t kLostMin = 10;
  static constexpr std::uint64_t kLostShare = 4;  // one of so many
  static constexpr Duration kStays = std::chrono::seconds(30);

  TimePoint begun_{};
  TimePoint moment_{};  // when the last one began
  TimePoint much_until_{};
  std::uint64_t taken_ = 0, lost_ = 0, moments_ = 0;
};

}  // namespace connect_bridge
