// The rates a rule sets for a topic (max_rate, max_bytes_per_second), each for one publisher.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>

#include "core/base/ids.hpp"
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
  // The amount that has passed and is not paid for yet.
  [[nodiscard]] double owed(TimePoint now) const;
  // Uses another rate from now on; what is paid or owed does not change.
  void set_rate(double per_second) { per_second_ = per_second; }
  [[nodiscard]] double rate() const { return per_second_; }

 private:
  double per_second_ = 0;  // 0: no limit
  Duration slack_{};
  TimePoint paid_ = TimePoint::min();  // when nothing is owed any more
};

// Time is divided into windows of 1 / max_rate, and one message passes for each. The windows are
// those of the messages' own stamps, so topics that share stamps (an image and its CameraInfo) let
// the same ones pass without knowing of each other. One window that was left out is made up for:
// a source of exactly max_rate passes whole, though its clock shakes.
class RateLimit {
 public:
  RateLimit() = default;  // no limit
  // Messages and bytes per second; 0: no limit.
  RateLimit(double max_rate, std::uint64_t bytes_per_second_max);

  // Whether a message of this size may pass now; if so, it is counted. `stamp`: the time that it
  // tells of, in ns; 0, or one that does not advance: the time of its arrival counts.
  [[nodiscard]] bool admit(std::size_t bytes, Stamp stamp, TimePoint now);
  // When the message that was refused last may leave after all, if no other one comes until then:
  // its publisher was silent for a period.
  [[nodiscard]] TimePoint leaves_at() const;
  // The refused message leaves now: count it.
  void leave(std::size_t bytes, TimePoint now);
  [[nodiscard]] bool has_rates_of(const RateLimit& other) const {
    return period_ == other.period_ && bytes_.rate() == other.bytes_.rate();
  }
  // Whether a message of any size would pass now, as if none had come before.
  [[nodiscard]] bool idle(TimePoint now) const;

 private:
  void advance(Stamp stamp, TimePoint now);
  [[nodiscard]] double window_of(Stamp ns) const;

  double period_ = 0;  // ns; 0: no limit
  double credit_ = 1;  // messages that may pass
  Stamp stamp_ = 0;    // of the message before
  TimePoint arrived_ = TimePoint::min();
  Throttle bytes_;
};

// The rate limits of a topic's publishers.
class RateLimits {
 public:
  RateLimits() = default;  // no limit
  RateLimits(double max_rate, std::uint64_t bytes_per_second_max)
      : fresh_(max_rate, bytes_per_second_max) {}

  [[nodiscard]] RateLimit& of(OriginId origin) {
    return limits_.try_emplace(origin, fresh_).first->second;
  }
  void forget(OriginId origin) { limits_.erase(origin); }

 private:
  RateLimit fresh_;
  std::unordered_map<OriginId, RateLimit> limits_;
};

}  // namespace connect_bridge
