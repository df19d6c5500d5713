// Our part of a path whose queue somebody else keeps full.
#pragma once

#include <cstdint>

#include "core/base/time.hpp"

namespace connect_bridge {

// A sender that fills the queue leaves nothing to one that holds back for every queue. So from
// begin() on at least rate() leaves, whatever the queue. It grows as long as what leaves arrives:
// had the path itself become slower, it would not. It ends at half of what the path carried alone;
// where that was never seen, at half of what arrives when more does not. It is given up when the
// queue grows: that of somebody else is as long as the path's buffer, ours as what we send.
//
// Rates in bytes per second. Belongs to one connection.
class PathShare {
 public:
  // A round trip in which there was always more to send.
  struct Round {
    double delivery = 0;              // what arrived, the best of some round trips
    std::uint64_t arrived_bytes = 0;  // since the connection opened
    double allowed = 0;               // what was allowed to leave
    double without = 0;               // what would be without the share
    double gain = 1;                  // less than 1: the sender holds back because of the queue
    bool tcp_limits = false;          // less has left than was allowed
    bool starting = false;
    Duration queue{};
    Duration answer{};  // until a change of the rate shows in what arrives
  };

  // The least rate that may leave; 0: nobody else is there.
  [[nodiscard]] double rate() const { return rate_; }
  // The most that the path has carried; 0: not known.
  [[nodiscard]] double best() const { return best_; }

  // The queue has stayed long although the sender held back.
  void begin(const Round& round, TimePoint now);
  void end_round(const Round& round, TimePoint now);
  // Beyond the one when it began, which counts as the path's delay from then on.
  void queue_is(Duration queue);
  // Now the queue is long, or the traffic does not show what the path carries.
  void path_is_not_seen(TimePoint now) { seen_since_ = now; }
  // There was nothing more to send for a while: what arrives over a pause is no rate.
  void pause(TimePoint now) {
    path_is_not_seen(now);
    trial_ = {now, {}, 0, false};
  }

 private:
  void grow(const Round& round, TimePoint now);
  void judge(const Round& round, TimePoint now);

  // Arrivals between begin and end show whether the path carries rate_. Their mean counts: the best
  // moment of a fading cell would allow more than the cell carries.
  struct Trial {
    TimePoint begin{};
    TimePoint end{};  // not before the begin: it has not begun
    std::uint64_t bytes = 0;
    bool tcp_limits = false;
  };

  double rate_ = 0;
  Trial trial_;
  Duration queue_{};       // when it began
  TimePoint needed_at_{};  // when less would have left without it, the last time
  double best_ = 0;
  bool best_is_all_ = false;  // nobody else was there then, or more would not have arrived
  TimePoint seen_since_{};
};

}  // namespace connect_bridge
