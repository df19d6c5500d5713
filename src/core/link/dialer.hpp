// When a client dials: exponential back-off with jitter, without end.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "core/base/ids.hpp"
#include "core/base/random.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

struct DialerOptions {
  Duration retry_min{};
  Duration retry_max{};
  // After a refused login: the token may be changed there. And after many answers of something that
  // is no server of ours, each of which costs as many bytes as a login.
  Duration refused_retry = std::chrono::seconds(5);
};

enum class DialFailure : std::uint8_t {
  kGone,      // nobody answered, or a connection was lost
  kAnswered,  // by a proxy without a server behind it, with a wrong certificate ...
  kRefused,   // the login, for longer
};

// At most one dial or connection at a time. Waiting -> (due) -> busy -> (failed, lost) -> waiting.
class Dialer {
 public:
  // After so many answers in a row, about 8 s of them, the next dials are rarer.
  static constexpr int kAnswersSoon = 20;

  explicit Dialer(DialerOptions options) : options_(options) {}

  // A dial is due: from now on busy.
  bool take_due(TimePoint now) {
    if (!next_ || *next_ > now) return false;
    next_.reset();
    return true;
  }
  void opened() { failures_ = answers_ = 0; }
  // Ends the wait for the next attempt, except after a refused login.
  void hurry(TimePoint now) {
    failures_ = 0;
    if (next_) next_ = std::min(*next_, std::max(now, not_before_));
  }
  // The dial or the connection failed; sets the next attempt.
  void failed(TimePoint now, DialFailure failure, Random& random);
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
  int answers_ = 0;  // in a row
};

}  // namespace connect_bridge
