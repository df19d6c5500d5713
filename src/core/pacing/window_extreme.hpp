// The minimum or maximum of recent values.
#pragma once

#include <deque>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge {

// Keeps only values that may still become the extreme: a new value removes all that it exceeds, and
// of values close in time only the first is kept. So at most kSteps are kept.
template <class Value>
class WindowExtreme {
 public:
  // Sign +1: maximum, -1: minimum.
  explicit WindowExtreme(int sign) : sign_(sign) {}

  void add(Value value, TimePoint now, Duration window) {
    while (!seen_.empty() && !beats(seen_.back().value, value)) seen_.pop_back();
    if (seen_.empty() || now - seen_.back().at > window / kSteps) seen_.push_back({value, now});
    while (seen_.size() > 1 && now - seen_.front().at > window) seen_.pop_front();
  }
  void clear() { seen_.clear(); }

  [[nodiscard]] bool empty() const { return seen_.empty(); }
  // Without a newer one the last value stays, however old it is.
  [[nodiscard]] Value get() const { return seen_.empty() ? Value{} : seen_.front().value; }

 private:
  struct Seen {
    Value value;
    TimePoint at;
  };
  [[nodiscard]] bool beats(Value a, Value b) const { return sign_ > 0 ? a > b : a < b; }

  static constexpr int kSteps = 32;
  int sign_;
  std::deque<Seen> seen_;
};

}  // namespace connect_bridge
