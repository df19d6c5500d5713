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
  // After a refused login, twice as long after the next, and so on for kRefusalsSoon of them: each
  // costs kilobytes, and a robot may pay for them by the megabyte. Only so long where nothing was
  // wrong with the login. Half of it more at random. Just so long after many answers of something
  // that is no server of ours.
  Duration refused_retry = std::chrono::seconds(5);
  // After an answer of a server with another key than ours has. Half of it more at random. Another
  // network, where its address may be that of the right one, ends the wait.
  Duration other_key_retry = std::chrono::minutes(2);
};

enum class DialFailure : std::uint8_t {
  kGone,      // nobody answered, or a connection was lost
  kAnswered,  // by a proxy without a server behind it, with a wrong certificate ...
  kOtherKey,  // by a server that is not the one of our pins
  kPutOff,    // the login could not be taken or judged now
  kRefused,   // the login or the protocol version, until somebody changes it
};

// At most one dial or connection at a time. Waiting -> (due) -> busy -> (failed, lost) -> waiting.
class Dialer {
 public:
  // After so many answers in a row, about 8 s of them, the next dials are rarer.
  static constexpr int kAnswersSoon = 20;
  static constexpr int kRefusalsSoon = 3;

  explicit Dialer(DialerOptions options) : options_(options) {}

  // A dial is due: from now on busy.
  bool take_due(TimePoint now) {
    if (!next_ || *next_ > now) return false;
    next_.reset();
    return true;
  }
  void opened() { failures_ = answers_ = refusals_ = 0; }
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
    refusals_ = 0;
    hurry(now);
  }
  void stop() { next_.reset(); }
  [[nodiscard]] std::optional<TimePoint> deadline() const { return next_; }

 private:
  DialerOptions options_;
  std::optional<TimePoint> next_ = TimePoint{};
  TimePoint not_before_{};
  int failures_ = 0;
  int answers_ = 0;   // in a row
  int refusals_ = 0;  // since a link was open
};

}  // namespace connect_bridge
