// The times when a client connects: exponential back-off with jitter, without end.
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
  // The wait after a refused login; up to half of it is added at random. The wait doubles with each
  // further refusal, kRefusalsSoon times, because each try costs kilobytes and a robot may pay by
  // the megabyte. It does not grow if the login could not be judged, or after many answers of
  // something that is no server of ours.
  Duration refused_retry = std::chrono::seconds(5);
  // The wait after a server answered with another key than the pinned one; up to half of it is
  // added at random. A change of the network ends the wait: the address may then be that of our
  // server.
  Duration other_key_retry = std::chrono::minutes(2);
};

enum class DialFailure : std::uint8_t {
  kGone,      // nobody answered, or a connection was lost
  kAnswered,  // a proxy without a server answered, or a server with a wrong certificate ...
  kOtherKey,  // a server answered that is not the one of our pins
  kPutOff,    // the login could not be taken or judged now
  kRefused,   // the login or the protocol version was refused, until somebody changes it
};

// At most one attempt or connection at a time: waiting -> (due) -> busy -> (lost) -> waiting.
class Dialer {
 public:
  // After this many answers in a row, within about 8 s, attempts become rarer.
  static constexpr int kAnswersSoon = 20;
  static constexpr int kRefusalsSoon = 3;

  explicit Dialer(DialerOptions options) : options_(options) {}

  // True: an attempt is due, and the dialer is busy from now on.
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
  // The attempt or the connection failed; sets the next attempt.
  void failed(TimePoint now, DialFailure failure, Random& random) {
    constexpr int kDoublingsMax = 16;
    const Duration doubled = options_.retry_min * (1 << std::min(failures_, kDoublingsMax));
    const Duration longest = std::max(options_.retry_min, std::min(doubled, options_.retry_max));
    ++failures_;
    // A random wait, so that many clients do not return at once.
    const auto up_to = [&random](Duration most) {
      return Duration(random.below(static_cast<std::uint64_t>(most.count() + 1)));
    };
    Duration wait = longest / 2 + up_to(longest / 2);
    answers_ = failure == DialFailure::kAnswered ? std::min(answers_ + 1, kAnswersSoon + 1) : 0;
    const bool refused = failure == DialFailure::kRefused;
    const bool by_server = refused || failure == DialFailure::kPutOff;
    if (by_server || answers_ > kAnswersSoon) {
      const Duration long_wait = options_.refused_retry * (1 << (refused ? refusals_ : 0));
      wait = std::max(wait, long_wait + up_to(long_wait / 2));
    }
    if (failure == DialFailure::kOtherKey)
      wait = options_.other_key_retry + up_to(options_.other_key_retry / 2);
    if (refused) refusals_ = std::min(refusals_ + 1, kRefusalsSoon);
    next_ = now + wait;
    not_before_ = by_server ? *next_ : TimePoint{};
  }
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
