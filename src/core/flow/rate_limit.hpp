// The rates a rule sets for a channel (max_rate, max_bytes_per_second). Asked before a message is
// queued.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.hpp"

namespace connect_bridge {

// Lets amounts pass at a rate that is exact on average. An amount of any size passes when those
// before it are paid for; `slack` is how much too early it may come (jitter of a periodic source, a
// small burst).
class Throttle {
 public:
  Throttle() = default;  // no limit
  Throttle(double per_second, Duration slack);

  [[nodiscard]] bool ready(TimePoint now) const;
  [[nodiscard]] TimePoint ready_at() const {
    return paid_ == TimePoint::min() ? paid_ : paid_ - slack_;
  }
  void take(double amount, TimePoint now);
  // What has passed and is not paid for yet.
  [[nodiscard]] double owed(TimePoint now) const;
  // Uses another rate from now on; what is paid or owed does not change.
  void set_rate(double per_second) { per_second_ = per_second; }
  [[nodiscard]] double rate() const { return per_second_; }

 private:
  double per_second_ = 0;  // 0: no limit
  Duration slack_{};
  TimePoint paid_ = TimePoint::min();  // when nothing is owed any more
};

class RateLimit {
 public:
  RateLimit() = default;  // no limit
  // Messages and bytes per second; 0: no limit.
  RateLimit(double max_rate, std::uint64_t bytes_per_second_max);

  // Whether a message of this size may pass now; if so, it is counted. False: drop it (kRate).
  [[nodiscard]] bool admit(std::size_t bytes, TimePoint now);
  // Whether these are its rates.
  [[nodiscard]] bool is(double max_rate, std::uint64_t bytes_per_second_max) const {
    return messages_.rate() == max_rate &&
           bytes_.rate() == static_cast<double>(bytes_per_second_max);
  }
  // All that passed is paid off.
  [[nodiscard]] bool idle(TimePoint now) const { return messages_.ready(now) && bytes_.ready(now); }

 private:
  Throttle messages_;
  Throttle bytes_;
};

}  // namespace connect_bridge
