// Chooses the TCP congestion control for the path of a connection, by TCP's own counts.
#pragma once

#include <deque>
#include <optional>
#include <string_view>

#include "core/base/time.hpp"
#include "net/tcp/traffic.hpp"

namespace connect_bridge {

// Our own pacing keeps the path's queue short (docs/flow.md). On such a path cubic is better: bbr
// sends next to nothing for 200 ms every ten seconds, to measure the round trip. But cubic takes
// each lost segment for a full queue. If some are lost all the time, as by radio, cubic slows down
// far too much, and bbr does not.
class CongestionChoice {
 public:
  static constexpr std::string_view kFirst = "cubic";
  static constexpr std::string_view kWithLosses = "bbr";
  static constexpr Duration kCalm = std::chrono::seconds(60);  // without losses: back to kFirst
  // Shortest time between two looks at the counts, beside two round trips: a single loss may last
  // that long.
  static constexpr Duration kLook = std::chrono::milliseconds(100);

  // Whether it is time to look at the counts.
  [[nodiscard]] bool is_due(TimePoint now) const;
  // The connection's algorithm from now on, if it changes. Call this when is_due().
  std::optional<std::string_view> next(const TcpCounts& counts, TimePoint now);

 private:
  void look(const TcpCounts& counts, TimePoint now);
  // Whether segments are lost again and again.
  [[nodiscard]] bool loses() const;

  struct Look {
    std::uint64_t segments = 0;
    std::uint64_t lost = 0;
    TimePoint at{};
  };

  std::string_view chosen_ = kFirst;
  std::deque<Look> looks_;  // the last looks
  Duration round_trip_{};
  std::optional<TimePoint> asked_at_;
  TimePoint lost_at_{};
};

}  // namespace connect_bridge
