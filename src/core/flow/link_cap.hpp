// Limits the bytes that a side sends on a link, for a connection that is paid by the megabyte.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/base/time.hpp"

namespace connect_bridge {

// Belongs to one connection. Bytes are those of IP packets, as a provider counts them: what TLS and
// the headers below a WebSocket message add is estimated at its maximum, and TCP's acknowledgements
// of received data count too. Segments that TCP sends again do not count.
class LinkCap {
 public:
  LinkCap() = default;  // no limit
  // 0: no limit; values below kRateMin mean kRateMin.
  explicit LinkCap(std::uint64_t bytes_per_second)
      : rate_(bytes_per_second == 0 ? 0
                                    : static_cast<double>(std::max(bytes_per_second, kRateMin))) {}

  // Bytes per second; 0: no limit.
  [[nodiscard]] double rate() const { return rate_; }
  // Another limit from now on; 0: none. The bytes that are not paid for yet stay due. Unlike the
  // constructor's, the limit may be below kRateMin: it may be a share of a larger one.
  void set_rate(double bytes_per_second, TimePoint now);
  // Bytes that were sent since the last call, also without a limit.
  std::uint64_t take_sent() { return std::exchange(sent_, 0); }
  // A path's rate, but not more than the limit; 0: not known.
  [[nodiscard]] double within(double path_rate) const {
    if (rate_ == 0 || path_rate == 0) return std::max(rate_, path_rate);
    return std::min(rate_, path_rate);
  }
  // When data that is subject to the cap may leave.
  [[nodiscard]] TimePoint next_at() const { return paid_; }  // mutant: link_cap
  [[nodiscard]] bool holds(TimePoint now) const { return paid_ > now; }
  // The largest part, at most `most`, that the cap pays for soon, because others wait meanwhile.
  // Parts smaller than a TCP segment would cost too much in headers.
  [[nodiscard]] std::uint32_t part_bytes(std::uint32_t most) const;

  // A WebSocket message of so many bytes was sent or received.
  void sent(std::size_t bytes, TimePoint now) { charge(cost(bytes), now); }
  void received(std::size_t bytes, TimePoint now);

  // Bytes that a message costs on the network.
  [[nodiscard]] static std::uint64_t cost(std::size_t bytes);

  static constexpr std::uint64_t kRateMin = 1000;
  // After a pause so much may leave at once: as much as the cap allows in this time.
  static constexpr Duration kBurst = std::chrono::milliseconds(100);
  // Data that is never held back may exceed the cap by so much; what exceeds this is not charged.
  static constexpr Duration kDebtMax = std::chrono::seconds(10);

 private:
  void charge(std::uint64_t bytes, TimePoint now);

  double rate_ = 0;
  TimePoint paid_{};  // when all that was sent is paid for
  std::uint64_t sent_ = 0;
};

}  // namespace connect_bridge
