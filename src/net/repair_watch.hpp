// Whether TCP repairs a loss of a connection, in either direction.
#pragma once

#include <cstdint>

#include "core/base/time.hpp"
#include "core/flow/repairs.hpp"
#include "net/traffic.hpp"

namespace connect_bridge {

// Watches TCP's repairs of lost segments. TCP reports which of our own segments are missing. Of the
// peer's segments it reports only how many came out of order: the gap is open from then on until
// something can be read.
class RepairWatch {
 public:
  // A round trip is hardly shorter than this where anything is lost.
  static constexpr Duration kPeriod = std::chrono::milliseconds(1);

  // Whether the kernel should be asked again.
  [[nodiscard]] bool is_due(TimePoint now) const { return now - told_at_ >= kPeriod; }
  void told(const TcpLosses& losses, TimePoint now) {
    losses_ = losses;
    told_at_ = now;
  }
  // A segment of the peer is missing.
  [[nodiscard]] bool misses() const { return losses_.too_early != too_early_read_; }
  // Data was read in order: by these counts of the kernel, what came out of order before is
  // complete.
  void has_read(const TcpLosses& losses) {
    losses_ = losses;
    too_early_read_ = losses.too_early;
  }

  [[nodiscard]] Repairs repairs() const {
    Repairs repairs = losses_.repairs;
    repairs.open = repairs.open || misses();
    return repairs;
  }

 private:
  TcpLosses losses_;
  TimePoint told_at_{};
  std::uint64_t too_early_read_ = 0;
};

}  // namespace connect_bridge
