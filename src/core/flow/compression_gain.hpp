// Decides from the last messages whether compression makes messages arrive sooner.
#pragma once

#include <cstddef>
#include <cstdint>

namespace connect_bridge {

// Predicts whether compression pays, for one channel, or for one topic on all links.
// Single-threaded.
class CompressionGain {
 public:
  // Whether a message of this size should be compressed for a path that carries `rate` bytes per
  // second (0: not known, then not), if compression costs `cost` seconds at both ends together.
  // After messages that did not shrink it is tried again from time to time, because content
  // changes.
  [[nodiscard]] bool pays(std::size_t raw_bytes, double rate, double cost) {
    if (rate <= 0) return false;
    if (likely_pays(raw_bytes, rate, cost)) return true;
    return sooner(raw_bytes, kRatioHoped, rate, cost) && ++passed_ % kTryPeriod == 0;
  }
  // The answer of pays() without its occasional try.
  [[nodiscard]] bool likely_pays(std::size_t raw_bytes, double rate, double cost) const {
    return rate > 0 && sooner(raw_bytes, ratio_, rate, cost);
  }
  // The message did not become smaller.
  void note_in_vain() { ratio_ = 1; }
  // The result of a compression: compressed size divided by raw size.
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
