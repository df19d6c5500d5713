// The rate at which messages may grow when they are decompressed.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/flow/rate_limit.hpp"

namespace connect_bridge {

// Compressed messages of robots are some 2 to 20 times smaller than their samples; an empty map is
// thousands of times smaller. Only growth beyond 32 times counts, so that a few bytes a second
// cannot become gigabytes. Each identity has such a pace, and all together have one.
// Single-threaded.
class InflationPace {
 public:
  static constexpr std::uint64_t kUsualRatioMax = 32;
  static constexpr double kBytesPerSecond = 64 << 20;
  // The latched maps of a robot come together.
  static constexpr Duration kAtOnce = std::chrono::seconds(10);
  // The loop stands still while it publishes such a sample, some 0.8 ms for each MiB. Larger
  // samples count up to eight times. The largest have one more pace, which does not hold up smaller
  // ones: one of 64 MiB comes in 16 s.
  static constexpr std::uint64_t kQuicklyPublished = 2 << 20;
  static constexpr std::uint64_t kSlownessMax = 8;
  static constexpr std::uint64_t kLarge = kSlownessMax * kQuicklyPublished;
  static constexpr double kLargeBytesPerSecond = 4 << 20;
  // An identity may exceed its pace by this much, whatever others do; by more only while all
  // identities together are within their pace.
  static constexpr double kPart = kBytesPerSecond;

  // The pace of this many identities.
  explicit InflationPace(int identities)
      : all_(identities * kBytesPerSecond, kAtOnce),
        large_(identities * kLargeBytesPerSecond, kAtOnce) {}

  // May a message of `raw_bytes`, whose body has `body_bytes`, be decompressed now? If so, it is
  // counted, also in the pace of all (null: there is none).
  [[nodiscard]] bool admit(std::uint64_t raw_bytes, std::uint64_t body_bytes, TimePoint now,
                           InflationPace* of_all) {
    const std::uint64_t usual = kUsualRatioMax * body_bytes;
    if (raw_bytes <= usual) return true;
    const std::uint64_t slowness =
        std::clamp<std::uint64_t>(raw_bytes / kQuicklyPublished, 1, kSlownessMax);
    const Cost cost{static_cast<double>(slowness * (raw_bytes - usual)),
                    raw_bytes > kLarge ? static_cast<double>(raw_bytes) : 0};
    if (!ready(cost, now)) return false;  // mutant: inflation
    const bool within_part = all_.owed(now) + cost.all <= kPart;
    if (of_all && !within_part && !of_all->ready(cost, now)) return false;
    take(cost, now);
    if (of_all) of_all->take(cost, now);
    return true;
  }
  // Nothing of the past counts any more.
  [[nodiscard]] bool idle(TimePoint now) const {
    return all_.owed(now) == 0 && large_.owed(now) == 0;
  }

 private:
  struct Cost {
    double all;
    double large;  // 0: the message is none of the largest
  };
  [[nodiscard]] bool ready(const Cost& cost, TimePoint now) const {
    return all_.ready(now) && (cost.large == 0 || large_.ready(now));
  }
  void take(const Cost& cost, TimePoint now) {
    all_.take(cost.all, now);
    if (cost.large > 0) large_.take(cost.large, now);
  }

  Throttle all_;
  Throttle large_;
};

}  // namespace connect_bridge
