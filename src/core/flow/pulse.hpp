// How often messages come, and since when none has.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge {

// Belongs to a topic on one link, from the beginning of its demand.
class Pulse {
 public:
  // Messages are expected from now on.
  void begin(TimePoint now) {
    *this = {};
    last_ = now;
  }
  void beat(TimePoint now) {
    if (count_ > 0) gap_ += (seconds(now - last_) - gap_) / static_cast<double>(weight());
    ++count_;
    last_ = now;
  }
  // Since the last message, or since the beginning.
  [[nodiscard]] Duration idle(TimePoint now) const { return now - last_; }
  // Messages in a second before that; nullopt: too few have come.
  [[nodiscard]] std::optional<double> usual_rate() const {
    if (count_ < kMany || gap_ <= 0) return std::nullopt;
    return 1 / gap_;
  }

 private:
  static constexpr std::uint64_t kMany = 20;
  static constexpr std::uint64_t kWeight = 8;  // a burst after a pause is not usual

  [[nodiscard]] std::uint64_t weight() const { return std::min(count_, kWeight); }
  [[nodiscard]] static double seconds(Duration time) {
    return std::chrono::duration<double>(time).count();
  }

  TimePoint last_{};
  double gap_ = 0;  // seconds
  std::uint64_t count_ = 0;
};

}  // namespace connect_bridge
