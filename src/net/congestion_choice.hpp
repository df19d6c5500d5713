// Which TCP congestion control suits the path of a connection, by what TCP itself counts.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/time.hpp"
#include "net/traffic.hpp"

namespace connect_bridge {

// Our own pacing keeps the path's queue short (docs/flow.md). On such a path cubic is the better
// one: bbr sends next to nothing for 200 ms every ten seconds, to measure the round trip. But cubic
// takes each lost segment for a full queue: where some are lost all the time, as by radio, it slows
// down far too much, and bbr does not.
class CongestionChoice {
 public:
  static constexpr std::string_view kFirst = "cubic";
  static constexpr std::string_view kWithLosses = "bbr";
  static constexpr Duration kCalm = std::chrono::seconds(60);  // without losses: kFirst again

  // What the connection should have from now on, if that changes. Call it about once a second.
  std::optional<std::string_view> next(const TcpCounts& counts, TimePoint now);

 private:
  // Whether many of the segments since it was last told were lost; nullopt: they are too few.
  std::optional<bool> loses(const TcpCounts& counts);

  std::string_view chosen_ = kFirst;
  TcpCounts told_;  // when that was last told
  bool lost_ = false;
  TimePoint lost_at_{};
};

}  // namespace connect_bridge
