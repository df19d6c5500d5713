// What a side may send on a link by the byte, for a connection that is paid by the megabyte.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/base/time.hpp"

namespace connect_bridge {

// Belongs to one connection. Bytes are those of IP packets, as a provider counts them: what TLS and
// the headers below a WebSocket message add is taken for as much as it may be, and TCP's
// acknowledgements of what arrives count, too. Segments that TCP sends again do not.
class LinkCap {
 public:
  LinkCap() = default;  // no limit
  // 0: no limit; what is less than kRateMin is taken for that.
  explicit LinkCap(std::uint64_t bytes_per_second)
      : rate_(bytes_per_second == 0 ? 0
                                    : static_cast<double>(std::max(bytes_per_second, kRateMin))) {}

  // Bytes per second; 0: no limit.
  [[nodiscard]] double rate() const { return rate_; }
  // A path's rate, but not more than the limit; 0: not known.
  [[nodiscard]] double within(double path_rate) const {
    if (rate_ == 0 || path_rate == 0) return std::max(rate_, path_rate);
    return std::min(rate_, path_rate);
  }
  // When what may be held back may leave.
  [[nodiscard]] TimePoint next_at() const { return paid_; }
  [[nodiscard]] bool holds(TimePoint now) const { return paid_ > now; }
  // The largest part, of `most`, that is still soon paid for: others wait for that. Parts smaller
  // than a TCP segment would cost more headers than they are worth.
  [[nodiscard]] std::uint32_t part_bytes(std::uint32_t most) const;

  // A WebSocket message of so many bytes leaves or has arrived.
  void sent(std::size_t bytes, TimePoint now) { charge(cost(bytes), now); }
  void received(std::size_t bytes, TimePoint now);

  // What a message costs on the network.
  [[nodiscard]] static std::uint64_t cost(std::size_t bytes);

  static constexpr std::uint64_t kRateMin = 1000;
  // What a silence lets pass at once: as much as in this time.
  static constexpr Duration kBurst = std::chrono::milliseconds(100);
  // What is never held back may go so far beyond; what is more is forgotten.
  static constexpr Duration kDebtMax = std::chrono::seconds(10);

 private:
  void charge(std::uint64_t bytes, TimePoint now);

  double rate_ = 0;
  TimePoint paid_{};  // when all that has passed is paid for
};

}  // namespace connect_bridge
