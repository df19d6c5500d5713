// The worst and the growth of the last minutes, so that the status shows neither the last second
// alone nor the fault of yesterday.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "core/base/time.hpp"
#include "ops/status/status_picture.hpp"

namespace connect_bridge {

// The growth of a counter since the period before the present one began.
class RecentGrowth {
 public:
  // The growth up to this value. A smaller value than before: the counter began again.
  std::uint64_t to(std::uint64_t value, std::int64_t period);

 private:
  std::uint64_t before_ = 0;  // when the last period began
  std::uint64_t begun_ = 0;   // when this period began
  std::uint64_t last_ = 0;
  std::int64_t period_ = 0;
};

// The largest value of this period and of the last one.
class RecentPeak {
 public:
  double to(double value, std::int64_t period);

 private:
  double before_ = 0;
  double now_ = 0;
  std::int64_t period_ = 0;
};

// The value that at least three looks of this period and the last one have reached, so that one
// moment is no state. Of looks that are close together the first one counts.
class RecentThird {
 public:
  double to(double value, std::int64_t period, TimePoint now);

 private:
  static constexpr Duration kApart = std::chrono::seconds(10);
  using Largest = std::array<double, 3>;  // in falling order

  Largest before_{};
  Largest now_{};
  std::int64_t period_ = 0;
  std::optional<TimePoint> looked_at_;
};

// Time is divided into periods of five minutes; "lately" means this period and the last one.
// Bounded: an entry for each topic and service that a status shows, and kLeftOutMax further ones of
// a link: their counts come back with them.
// Single-threaded.
class Lately {
 public:
  static constexpr Duration kPeriod = std::chrono::minutes(5);
  // A picture is needed so often, also if nobody asks for one.
  static constexpr Duration kLook = std::chrono::minutes(1);
  // Topics, and services, that a link no longer shows. Beyond that it keeps none of them.
  static constexpr std::size_t kLeftOutMax = 4096;

  explicit Lately(TimePoint start) : start_(start), looked_at_(start) {}

  // Once a second: the delay of the loop in it, and whether that is worth a word.
  void on_second(double lag_ms, bool held_up, TimePoint now);
  [[nodiscard]] bool is_due(TimePoint now) const { return now - looked_at_ >= kLook; }
  // Adds what belongs to the side, and begins a picture; all links follow before the next one.
  void add(RunStatus& run, const Status& side, TimePoint now);
  // Adds what belongs to the link and its topics.
  void add(LinkStatus& link, TimePoint now);

 private:
  struct OfTopic {
    TimePoint seen{};  // the last picture with it
    RecentGrowth messages, wire_bytes;
    std::map<std::size_t, RecentGrowth> dropped;  // by reason
  };
  struct OfService {
    TimePoint seen{};
    RecentGrowth answered, timed_out, refused, lost;
  };
  struct OfLink {
    TimePoint seen{};
    RecentThird path_queue_ms;
    RecentGrowth segments, retransmitted;
    std::map<std::string, OfTopic> topics;  // by direction and name
    std::map<std::string, OfService> services;
  };

  [[nodiscard]] std::int64_t period(TimePoint now) const { return (now - start_) / kPeriod + 1; }
  // `shown`: entries that the picture of `now` has.
  template <class Entries>
  static void forget(Entries& known, std::size_t shown, TimePoint now);

  TimePoint start_;
  TimePoint looked_at_;
  RecentPeak lag_ms_, memory_;
  RecentGrowth held_up_, refused_, wrong_logins_, logins_not_judged_;
  std::uint64_t held_up_seconds_ = 0;
  std::map<std::uint64_t, OfLink> links_;  // by number
};

}  // namespace connect_bridge
