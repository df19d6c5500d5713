// A path between two pacers in virtual time: rate, delay, a queue, acknowledgements that come in
// bunches. Urgent messages cross it together with bulk.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/base/time.hpp"

namespace connect_bridge::flow_test {

struct BedDirection {
  // Bytes per second at a time since the beginning.
  std::function<double(Duration)> rate;
  Duration delay = std::chrono::milliseconds(10);
  Duration detour{};  // more delay from detour_at on
  Duration detour_at{};
  Duration bunch{};   // packets arrive at multiples of this only; zero: at any time
  Duration jitter{};  // on top of the delay, on the average; order is kept
  // A TCP connection of somebody else that never ends is on the path in this time.
  Duration foreign_from{}, foreign_to{};
  double loss = 0;                  // share of packets that is lost, as TCP repairs it
  std::uint32_t segment_bytes = 0;  // as TCP tells it; 0: it does not
  double bulk_per_second = 0;       // messages of bulk_bytes; a newer one displaces what waits
  Duration bulk_from{};
  std::uint32_t bulk_bytes = 500'000;
};

struct BedOptions {
  BedDirection there;
  BedDirection back;
  Duration lasts = std::chrono::seconds(15);
  Duration warm_up = std::chrono::seconds(2);  // not judged
  Duration target = std::chrono::milliseconds(2);
};

struct BedResult {
  // Of urgent messages of 12 bytes at 50 Hz, one way, beyond the direction's delay; with when each
  // arrived.
  struct Wait {
    Duration at;
    Duration wait;
  };
  std::vector<Wait> waits;
  double bulk_share = 0;  // of what the direction could carry
  [[nodiscard]] double percentile_ms(double share) const;
  [[nodiscard]] double worst_ms(Duration from, Duration to) const;
};

struct BedResults {
  BedResult there;
  BedResult back;
};

std::function<double(Duration)> megabits(double rate);
// Robot to operator at 18 Mbit/s, back at 58; twice of what fits goes there.
BedOptions thin_link();

BedResults run_bed(const BedOptions& options);

}  // namespace connect_bridge::flow_test
