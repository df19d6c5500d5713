// Checks the topics that last: whatever is cut, each message of a reliable publisher reaches each
// reliable subscriber once, in order, without a gap. What is lost may only be lost with a process.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>

#include "sim/crowd.hpp"
#include "sim/ledger.hpp"
#include "sim/middleware.hpp"

namespace connect_bridge::sim {

class StreamCheck {
 public:
  StreamCheck(const Ledger& ledger, const Crowd& crowd) : ledger_(ledger), crowd_(crowd) {}

  void on_delivery(const Reader& reader, const Writer& mirror, const Sample& sample);

  // A process is about to end, and starts again: what was not delivered yet may be lost, and what
  // is published until it is linked again.
  void begin_break();
  void end_break(TimePoint linked);

  // To be called when nothing has been published for a while: nothing is still under way.
  void check_complete() const;
  // Streams of endpoints that the middleware has forgotten, and breaks of long ago.
  void forget();

  [[nodiscard]] std::uint64_t judged() const { return judged_; }
  [[nodiscard]] std::uint64_t excused() const { return excused_; }

 private:
  struct Break {
    TimePoint from{};
    std::optional<TimePoint> to;  // nullopt: it goes on
  };
  [[nodiscard]] bool is_lasting(const Reader& reader, const Writer& origin) const;
  [[nodiscard]] bool is_excused(int origin, std::uint64_t counter) const;
  void check_pair(const Reader& reader, const Writer& origin) const;

  const Ledger& ledger_;
  const Crowd& crowd_;
  std::map<std::pair<int, int>, std::uint64_t> last_;  // (reader, origin): the last counter
  std::deque<Break> breaks_;
  std::uint64_t judged_ = 0, excused_ = 0;
};

}  // namespace connect_bridge::sim
