// Divides the bytes that a side may send per second among its links.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/time.hpp"

namespace connect_bridge {

// A provider bills all that a side sends, so one limit holds for all links together. At the end of
// each period every link gets a share as its own limit: equal shares for the identities, and of an
// identity's share equal ones for its links. A share that is not needed goes to those who wait.
// Bytes beyond the limit, such as urgent messages, are owed: later periods divide less.
// Single-threaded.
class SideCap {
 public:
  // A link in the period that ends.
  struct Use {
    const void* identity = nullptr;  // compared only
    std::uint64_t sent = 0;          // bytes
    bool waits = false;              // it would have sent more
  };

  // 0: no limit; values below LinkCap::kRateMin mean that.
  explicit SideCap(std::uint64_t bytes_per_second);
  // Another limit from now on. What is owed stays; without a limit before, nothing is.
  void set(std::uint64_t bytes_per_second);

  [[nodiscard]] bool limits() const { return rate_ > 0; }
  // When the present period ends; nullopt: nothing is sent or owed, and nothing waits.
  [[nodiscard]] std::optional<TimePoint> deadline() const { return ends_; }
  // A link has sent something. The period ends early when all together have sent a whole one's
  // bytes: links that were idle may each have sent at the side's rate.
  void sent(TimePoint now, std::uint64_t bytes);
  // Bytes of IP packets that the process has sent since its start. They include what no link sends:
  // logins, refused visitors, a relay's control connection, repeated segments.
  void counted(std::uint64_t sent_bytes, TimePoint now);

  // Ends the period, also before its time. Returns each link's highest rate from now on, in the
  // order of `links`, in bytes per second.
  std::vector<double> divide(const std::vector<Use>& links, TimePoint now);

  static constexpr Duration kPeriod = std::chrono::milliseconds(100);
  // What is owed, or was left unused, is made up for within this time.
  static constexpr Duration kPaidBack = std::chrono::seconds(1);
  // Part of the limit that is divided however much is owed: urgent messages do not stop the rest.
  static constexpr double kLeast = 0.05;
  // Part of the limit that bytes of no link take from the links at most, over some seconds:
  // strangers cause most of them.
  static constexpr double kOfOthers = 0.5;

 private:
  void begin(TimePoint now) {
    began_ = now;
    ends_ = now + kPeriod;
    in_period_ = 0;
  }
  void owe(double bytes);

  double rate_ = 0;  // bytes per second
  double owed_ = 0;  // bytes; negative: saved up
  TimePoint began_{};
  std::optional<TimePoint> ends_;
  std::uint64_t in_period_ = 0;           // bytes that links have sent since it began
  std::optional<std::uint64_t> counted_;  // by the last counted()
  TimePoint counted_at_{};
  double known_ = 0;      // bytes of links since then
  double of_others_ = 0;  // bytes of no link that may be owed at `counted_at_`
};

// The level up to which each may take of `amount`, so that nobody who wants more than the level
// gets less than another: max-min fairness. `wanted` is at least 0; infinity: as much as there is.
[[nodiscard]] double fair_level(double amount, std::vector<double> wanted);

}  // namespace connect_bridge
