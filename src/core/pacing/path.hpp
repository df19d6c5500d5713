// The path to the peer as the acknowledgements show it: its rate, its delay, its queue.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>

#include "core/base/time.hpp"
#include "core/pacing/repairs.hpp"
#include "core/pacing/window_extreme.hpp"

namespace connect_bridge {

// A packet with data that was sent. `end`: bytes sent up to and including its last one.
struct SentPacket {
  std::uint64_t end = 0;
  std::uint32_t bytes = 0;
  TimePoint at{};
  bool asks = false;        // for an acknowledgement at once
  bool more_waits = false;  // more data waited to be sent after it
};

// An acknowledgement: so many bytes had arrived at the peer, the last one at `at` by its steady
// clock, in ns since an arbitrary start.
struct Arrival {
  std::uint64_t received_bytes = 0;
  Stamp at = 0;
};

// Belongs to one connection. Bounded by the window of what is not acknowledged.
class Path {
 public:
  void sent(const SentPacket& packet);
  void repairs(const Repairs& counted);
  // A loss is being repaired, or was, and the acknowledgements of what waited have not come yet.
  [[nodiscard]] bool is_repaired() const { return repairs_.open || acked_bytes_ < repair_end_; }
  // Everything is acknowledged, and there was nothing more to send.
  [[nodiscard]] bool idle() const { return flight_.empty() && limited_end_ == sent_bytes_; }

  // The path is longer than it was: what the next packets take is its delay without a queue.
  void forget_base();

  // The data that an acknowledgement covers.
  struct Covered {
    std::uint64_t end = 0;
    bool limited = false;      // the traffic, not the path, limited the rate
    bool behind_loss = false;  // it may have waited for TCP's repair of a loss
    bool recovered = false;    // the last data that was on its way when the path stood still
  };
  // Nullopt: it acknowledges nothing new.
  std::optional<Covered> acknowledged(const Arrival& ack, TimePoint now);

  [[nodiscard]] std::uint64_t sent_bytes() const { return sent_bytes_; }
  [[nodiscard]] std::uint64_t acked_bytes() const { return acked_bytes_; }
  [[nodiscard]] std::uint32_t segment_bytes() const { return repairs_.segment_bytes; }
  // Bytes of packets with data. What waits behind a lost segment is not in flight any more.
  [[nodiscard]] std::uint64_t in_flight_bytes() const {
    return is_repaired() ? std::min(in_flight_bytes_, repairs_.under_way_bytes) : in_flight_bytes_;
  }
  [[nodiscard]] std::uint64_t bytes_since_asked() const { return sent_bytes_ - asked_end_; }
  [[nodiscard]] TimePoint asked_at() const { return asked_at_; }
  // Since when a requested acknowledgement is waited for.
  [[nodiscard]] std::optional<TimePoint> waits_since() const {
    return asks_.empty() ? std::nullopt : std::optional(asks_.front());
  }

  // The shortest of the last kBaseWindow, at least kRoundTripMin; kRoundTripUnknown before.
  [[nodiscard]] Duration round_trip() const;
  [[nodiscard]] bool knows_round_trip() const { return !round_trip_.empty(); }
  // By how much acknowledgements come later than that, on average.
  [[nodiscard]] Duration lateness() const { return lateness_; }
  // The part of it that is the acknowledgements' own: without what their packets have waited.
  [[nodiscard]] Duration lateness_back() const { return lateness_back_; }
  // How long packets wait in queues on the way to the peer: the least of three quarters of a round
  // trip.
  [[nodiscard]] Duration queue() const { return queue_; }
  // By how much the delay varies within a round trip, on average: the path's own jitter.
  [[nodiscard]] Duration jitter() const { return jitter_; }
  // Bytes per second: the maximum of the last four round trips, and that of the last half round
  // trip. 0: not known.
  [[nodiscard]] double delivery() const { return delivery_.get(); }
  [[nodiscard]] double latest_delivery() const { return latest_delivery_; }

  static constexpr Duration kBaseWindow = std::chrono::seconds(10);
  static constexpr Duration kRoundTripMin = std::chrono::milliseconds(1);
  static constexpr Duration kRoundTripUnknown = std::chrono::milliseconds(100);
  // Bytes that may leave in a round trip while nothing is known (RFC 6928 allows TCP about half).
  static constexpr double kFirstBytes = 32 << 10;

 private:
  struct Counted {
    Arrival arrival;
    bool limited = false;
  };
  void measure_delay(const SentPacket& last, const Arrival& ack, TimePoint now);
  void measure_rate(const Arrival& ack, const Covered& covered, TimePoint now);
  [[nodiscard]] bool has_stood(const Arrival& ack) const;
  [[nodiscard]] bool waited_for_repair(std::uint64_t end, TimePoint now);
  [[nodiscard]] Duration rate_window() const;
  [[nodiscard]] bool queue_stays(TimePoint now) const;

  std::deque<SentPacket> flight_;
  std::uint64_t sent_bytes_ = 0;
  std::uint64_t acked_bytes_ = 0;
  std::uint64_t in_flight_bytes_ = 0;
  std::uint64_t limited_end_ = 0;  // up to this byte count there was not always more to send
  std::uint64_t asked_end_ = 0;
  std::deque<TimePoint> asks_;  // when those of flight_ that ask were sent
  TimePoint asked_at_{};
  // End of what was sent before the path was found to have stood still; it is still on its way.
  std::uint64_t stood_end_ = 0;

  Repairs repairs_;
  std::uint64_t repair_end_ = 0;  // up to this byte count data may wait for a repeated segment
  TimePoint unhindered_at_{};     // when something last came that did not have to wait

  // Nanoseconds. The clocks' offset is unknown and does not matter: only differences count.
  WindowExtreme<double> one_way_{-1};
  WindowExtreme<double> round_trip_{-1};
  WindowExtreme<double> waited_{-1};
  WindowExtreme<double> waited_most_{+1};
  WindowExtreme<double> delivery_{+1};
  double latest_delivery_ = 0;
  Duration lateness_{}, lateness_back_{};
  Duration queue_{};
  std::optional<TimePoint> long_since_;  // since when the queue is long
  Duration jitter_{};
  std::deque<Counted> arrivals_;  // of the last half round trip, and the one before these
  double waited_now_ = 0;         // of the last arrival
};

}  // namespace connect_bridge
