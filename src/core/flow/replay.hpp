// The messages of a queue that were kept over a break: the first of those that wait there.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/base/time.hpp"
#include "core/flow/out_message.hpp"

namespace connect_bridge {

// Neither depth nor bytes limit these messages, nor what joins them while some still wait: it was
// to follow them. They leave one by one: what comes at once overflows the queues of subscribers,
// which nothing holds back. Belongs to a ChannelQueue.
class Replay {
 public:
  // From one to the next: what lets all leave soon, between these. A subscriber that keeps ten may
  // look away for 8 to 20 ms.
  static constexpr Duration kApart = std::chrono::microseconds(800);
  static constexpr Duration kApartMost = std::chrono::milliseconds(2);
  static constexpr Duration kSoon = std::chrono::milliseconds(500);
  // However many they are, and however fast more join them: after so long none is held back.
  static constexpr Duration kTimeMax = std::chrono::seconds(10);

  // Messages added from now on belong to the replay; `joins_until`: later ones do not.
  void begin(TimePoint now, TimePoint joins_until) {
    ends_at_ = std::min(now + kTimeMax, joins_until);
    joins_until_ = joins_until;
    soon_at_ = now + kSoon;
    next_at_ = now;
  }
  void add(std::size_t body_bytes) {
    ++count_;
    bytes_ += body_bytes;
  }
  void remove(std::size_t body_bytes) {
    --count_;
    bytes_ -= body_bytes;
  }
  // Whether a message that comes behind them is one of them, where they may have so many bytes.
  [[nodiscard]] bool takes(const OutMessage& message, std::uint64_t bytes_max,
                           TimePoint now) const {
    return count_ > 0 && message.resumes && now < joins_until_ &&
           kept_bytes() + kept_bytes_of(message) <= bytes_max;
  }
  // The first of them leaves. One that is late itself makes the next no earlier. What takes more
  // than half of its room is not held back, so that it does not cost what would join it.
  void begun(std::uint64_t bytes_max, TimePoint now) {
    next_at_ = now;
    if (count_ == 0 || kept_bytes() > bytes_max / 2) return;
    const Duration left = std::max(ends_at_ - now, Duration::zero());
    const auto those = static_cast<Duration::rep>(count_);
    const Duration apart = std::clamp((soon_at_ - now) / those, kApart, kApartMost);
    next_at_ += std::min(apart, left / those);
  }
  // When the next may leave.
  [[nodiscard]] TimePoint next_at() const { return next_at_; }

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }  // of bodies

 private:
  [[nodiscard]] std::uint64_t kept_bytes() const { return bytes_ + count_ * kKeptMessageBytes; }

  std::size_t count_ = 0;
  std::uint64_t bytes_ = 0;
  TimePoint joins_until_{};
  TimePoint soon_at_{};
  TimePoint ends_at_{};
  TimePoint next_at_{};
};

}  // namespace connect_bridge
