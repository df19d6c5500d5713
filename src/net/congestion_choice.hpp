// Which TCP congestion control suits the path of a connection, by what TCP itself counts.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/time.hpp"
#include "net/traffic.hpp"

namespace connect_bridge {

// Our own pacing keeps the path's queue short (docs/flow.md). On such a path cubic is the better
// one: bbr sends next to nothing for 200 ms every ten seconds, to measure the round trip, and gets
// little beside other traffic. But cubic takes each lost segment for a full queue: where segments
// are lost while the queue is short, as by radio, it slows down far too much, and bbr does not.
class CongestionChoice {
 public:
  static constexpr std::string_view kFirst = "cubic";
  static constexpr std::string_view kWithLosses = "bbr";
  static constexpr Duration kCalm = std::chrono::seconds(60);  // without losses: kFirst again

  // What the connection should have from now on, if that changes. Call it about once a second.
  std::optional<std::string_view> next(const TcpCounts& counts, TimePoint now);

 private:
  enum class Weather : std::uint8_t { kCalm, kLossy, kFull };
  // Of the segments since it was last told; nullopt: they are too few.
  std::optional<Weather> weather(const TcpCounts& counts);

  std::string_view chosen_ = kFirst;
  std::uint64_t told_ = 0;   // segments, when the weather was last told
  std::uint64_t seen_ = 0;   // lost ones, at the last call
  std::uint64_t short_ = 0;  // lost since the weather was last told, while the queue was short
  std::uint64_t long_ = 0;   // likewise, while it was long
  Weather last_ = Weather::kCalm;
  TimePoint lossy_at_{};  // when it was last not calm
};

}  // namespace connect_bridge
