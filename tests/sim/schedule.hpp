// The one virtual clock of a simulated world and what is to happen when.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/base/time.hpp"

namespace connect_bridge::sim {

// An error that a checker found, as one sentence. Ends the seed.
struct Violation : std::runtime_error {
  using std::runtime_error::runtime_error;
};

[[noreturn]] inline void violated(const std::string& sentence) {
  throw Violation{sentence};
}

// Events run in the order of their times; events of the same time in the order of their making.
class Schedule {
 public:
  [[nodiscard]] TimePoint now() const { return now_; }

  void at(TimePoint when, std::function<void()> what) {
    heap_.push_back(Event{std::max(when, now_), ++made_, std::move(what)});
    std::push_heap(heap_.begin(), heap_.end());
  }
  void after(Duration delay, std::function<void()> what) { at(now_ + delay, std::move(what)); }

  // Runs everything up to `end` and leaves the clock there.
  void run_until(TimePoint end) {
    if (end < now_) violated("the simulation would go back in time");
    while (!heap_.empty() && heap_.front().when <= end) {
      std::pop_heap(heap_.begin(), heap_.end());
      Event event = std::move(heap_.back());
      heap_.pop_back();
      now_ = event.when;
      if (++run_ > events_max_) violated("the world does not come to rest: too many events");
      event.what();
    }
    now_ = end;
  }

  [[nodiscard]] std::uint64_t events() const { return run_; }
  void allow(std::uint64_t events_max) { events_max_ = events_max; }

 private:
  std::uint64_t events_max_ = 20'000'000;

  struct Event {
    TimePoint when;
    std::uint64_t number = 0;
    std::function<void()> what;
    // The heap keeps the greatest in front, so the earliest must be the greatest.
    bool operator<(const Event& other) const {
      return when != other.when ? when > other.when : number > other.number;
    }
  };

  TimePoint now_{};
  std::uint64_t made_ = 0;
  std::uint64_t run_ = 0;
  std::vector<Event> heap_;
};

inline double seconds(Duration d) {
  return std::chrono::duration<double>(d).count();
}
inline double seconds(TimePoint t) {
  return seconds(t.time_since_epoch());
}

}  // namespace connect_bridge::sim
