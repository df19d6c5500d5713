// Whether compressing brings messages sooner to their end, as the last ones tell.
#pragma once

#include <cstddef>
#include <cstdint>

namespace connect_bridge {

// Of one channel, or of one topic for all links. Single-threaded.
class CompressionGain {
 public:
  // Whether a message of this size should be compressed for a path that carries `rate` bytes per
  // second (0: not known, then not), if that takes `cost` seconds at both ends together. What has
  // not shrunk lately is tried again now and then: content changes.
  [[nodiscard]] bool pays(std::size_t raw_bytes, double rate, double cost) {
    if (rate <= 0) return false;
    if (likely_pays(raw_bytes, rate, cost)) return true;
    return sooner(raw_bytes, kRatioHoped, rate, cost) && ++passed_ % kTryPeriod == 0;
  }
  // The same without a try.
  [[nodiscard]] bool likely_pays(std::size_t raw_bytes, double rate, double cost) const {
    return rate > 0 && sooner(raw_bytes, ratio_, rate, cost);
  }
  // It did not become smaller.
  void note_in_vain() { ratio_ = 1; }
  // What came of a try: the size in relation to the raw one.
  void note(double ratio) { ratio_ += (ratio - ratio_) / 4; }
  [[nodiscard]] double ratio() const { return ratio_; }

  static constexpr std::uint32_t kTryPeriod = 64;  // messages

 private:
  static constexpr double kRatioHoped = 0.5;  // while nothing is known

  [[nodiscard]] static bool sooner(std::size_t raw_bytes, double ratio, double rate, double cost) {
    return static_cast<double>(raw_bytes) * (1 - ratio) / rate > cost;
  }

  double ratio_ = kRatioHoped;
  std::uint32_t passed_ = 0;
};

}  // namespace connect_bridge
