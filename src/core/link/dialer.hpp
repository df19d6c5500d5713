// When a client dials: exponential back-off with jitter, without end.
#pragma once

#include <algorithm>
#include <optional>

#include "core/base/ids.hpp"
#include "core/base/random.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

struct DialerOptions {
  Duration retry_min{};
  Duration retry_max{};
  Duration refused_retry =
      std::chrono::seconds(5);  // after a refused login: the token may be changed there
};

// At most one dial or connection at a time. Waiting -> (due) -> busy -> (failed, lost) -> waiting.
class Dialer {
 public:
  explicit Dialer(DialerOptions options) : options_(options) {}

  // A dial is due: from now on busy.
  bool take_due(TimePoint now) {
    if (!next_ || *next_ > now) return false;
    next_.reset();
    return true;
  }
  void opened() { failures_ = 0; }
  // Ends the wait for the next attempt, except after a refused login.
  void hurry(TimePoint now) {
    failures_ = 0;
    if (next_) next_ = std::min(*next_, std::max(now, not_before_));
  }
  // The dial or the connection failed; sets the next attempt.
  void failed(TimePoint now, bool login_refused, Random& random);
  // The refused credential has been changed: ends the wait.
  void forget_refusal(TimePoint now) {
    not_before_ = {};
    hurry(now);
  }
  void stop() { next_.reset(); }
  [[nodiscard]] std::optional<TimePoint> deadline() const { return next_; }

 private:
  DialerOptions options_;
  std::optional<TimePoint> next_ = TimePoint{};
  TimePoint not_before_{};
  int failures_ = 0;
};

}  // namespace connect_bridge
