// How large a part may be so that the next urgent message need not wait long behind it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge {

// A part takes about kPartTime on the wire: the rate at which the peer acknowledges tells its size.
// It only sizes parts; it paces nothing.
class PartSize {
 public:
  static constexpr Duration kPartTime = std::chrono::milliseconds(5);
  static constexpr std::uint64_t kPartBytesMin = 1024;
  // Acknowledgements that come in a bunch would show any rate: what proves a fast link is summed
  // over at least this long.
  static constexpr Duration kSpanMin = std::chrono::milliseconds(2);

  // Packet bytes leave. `idle`: nothing was unacknowledged before.
  void sent(bool idle, TimePoint now) {
    if (idle) since_ = now;
  }

  // The peer acknowledged `bytes` more. `backlogged`: more waited to be sent all the time, so that
  // the link and not the traffic made the rate.
  void acknowledged(std::uint64_t bytes, bool backlogged, TimePoint now) {
    const Duration took = since_ ? now - *since_ : Duration::zero();
    since_ = now;
    if (took <= Duration::zero()) return;
    if (backlogged) {
      rates_[next_rate_] = rate_of(bytes, took);
      next_rate_ = (next_rate_ + 1) % rates_.size();
    }
    span_.bytes += bytes;
    span_.took += took;
    if (span_.took < kSpanMin) return;
    spans_[next_span_] = span_;
    next_span_ = (next_span_ + 1) % spans_.size();
    span_ = {};
  }

  // At most `limit`; at most `unproven` while the link has not carried more in kPartTime.
  [[nodiscard]] std::uint32_t bytes(std::uint32_t limit, std::uint32_t unproven) const {
    // The fastest of the last intervals: others were held up by something else than the link.
    const double fastest = *std::max_element(rates_.begin(), rates_.end());
    const std::uint64_t small = std::min(limit, unproven);
    const std::uint64_t by_interval =
        fastest == 0 ? small : std::min(small, std::max(part_of(fastest), kPartBytesMin));
    // Whatever the traffic was: so much the link carried, on the average of the last spans.
    return static_cast<std::uint32_t>(
        std::min<std::uint64_t>(limit, std::max(by_interval, part_of(sustained()))));
  }

 private:
  struct Span {
    std::uint64_t bytes = 0;
    Duration took{};
  };

  static double rate_of(std::uint64_t bytes, Duration took) {
    return static_cast<double>(bytes) / static_cast<double>(took.count());
  }
  static std::uint64_t part_of(double rate) {
    return static_cast<std::uint64_t>(std::min(rate * static_cast<double>(kPartTime.count()), 1e9));
  }
  [[nodiscard]] double sustained() const {
    Span all;
    for (const Span& span : spans_) {
      all.bytes += span.bytes;
      all.took += span.took;
    }
    return all.took > Duration::zero() ? rate_of(all.bytes, all.took) : 0;
  }

  std::array<double, 8> rates_{};  // bytes per nanosecond, of backlogged intervals; 0: none
  std::size_t next_rate_ = 0;
  std::array<Span, 8> spans_{};
  std::size_t next_span_ = 0;
  Span span_;  // the one that is being measured
  std::optional<TimePoint> since_;
};

}  // namespace connect_bridge
