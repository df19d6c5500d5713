// Detects whether TCP repairs a loss on a connection, in either direction.
#pragma once

#include <cstdint>

#include "core/base/time.hpp"
#include "core/pacing/repairs.hpp"
#include "net/tcp/traffic.hpp"

namespace connect_bridge {

// Watches TCP's repairs of lost segments. TCP reports which of our own segments are missing. Of the
// peer's segments it reports only how many came out of order: the gap counts as open from then on
// until something can be read.
class RepairWatch {
 public:
  // A round trip is hardly shorter than this on a path that loses anything.
  static constexpr Duration kPeriod = std::chrono::milliseconds(1);

  // Whether it is time to query the kernel again.
  [[nodiscard]] bool is_due(TimePoint now) const { return now - noted_at_ >= kPeriod; }
  void note(const TcpCounts& counts, TimePoint now) {
    repairs_ = counts.repairs;
    too_early_ = counts.too_early;
    noted_at_ = now;
  }
  // Whether a segment of the peer is missing.
  [[nodiscard]] bool misses() const { return too_early_ != too_early_read_; }
  // Data was read in order: segments that came out of order before these counts are complete now.
  void has_read(const TcpCounts& counts) {
    repairs_ = counts.repairs;
    too_early_ = too_early_read_ = counts.too_early;
  }

  [[nodiscard]] Repairs repairs() const {
    Repairs repairs = repairs_;
    repairs.open = repairs.open || misses();
    return repairs;
  }

 private:
  Repairs repairs_;
  TimePoint noted_at_{};
  std::uint64_t too_early_ = 0;
  std::uint64_t too_early_read_ = 0;
};

}  // namespace connect_bridge
