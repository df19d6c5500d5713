// The rates a rule sets for a topic (max_rate, max_bytes_per_second), each for one publisher.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <unordered_map>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/flow/out_message.hpp"

namespace connect_bridge {

// Lets amounts pass at a rate that is exact on average. An amount of any size passes when those
// before it are paid for; `slack` is how much too early it may come (jitter of a periodic source, a
// small burst).
class Throttle {
 public:
  Throttle() = default;  // no limit
  Throttle(double per_second, Duration slack);

  // `sooner`: how much earlier than usual.
  [[nodiscard]] bool ready(TimePoint now, Duration sooner = Duration::zero()) const;
  [[nodiscard]] TimePoint ready_at() const {
    return paid_ == TimePoint::min() ? paid_ : paid_ - slack_;
  }
  void take(double amount, TimePoint now);
  // The amount that has passed and is not paid for yet.
  [[nodiscard]] double owed(TimePoint now) const;
  // Uses another rate from now on; what is paid or owed does not change.
  void set_rate(double per_second) { per_second_ = per_second; }
  [[nodiscard]] double rate() const { return per_second_; }

 private:
  double per_second_ = 0;  // 0: no limit
  Duration slack_{};
  TimePoint paid_ = TimePoint::min();  // when nothing is owed any more
};

// Time is divided into windows of 1 / max_rate, and one message passes for each. The windows are
// those of the messages' own stamps, so topics that share stamps (an image and its CameraInfo) let
// the same ones pass without knowing of each other, and so do those that a path has held up. Stamps
// let no more pass than the time here, of which up to a minute is saved up: whoever sends them may
// write what it likes. One window that was left out is made up for: a source of exactly max_rate
// passes whole, though its clock shakes.
//
// Each state of the publisher has windows of its own: a node sends the frames of several parts in
// turn, and a limit for all together would let some of them starve. Bytes are the publisher's.
//
// A group of a video passes from its key frame up to the first packet that is too much: what
// arrives can be decoded. So that more than key frames pass, a second of the rates is saved up.
class RateLimit {
 public:
  // States with windows of their own. Further ones share windows until some are idle.
  static constexpr std::size_t kStatesMax = 256;
  static constexpr std::size_t kStateBytes = 96;  // memory of each

  RateLimit() = default;  // no limit
  // Messages and bytes per second; 0: no limit.
  RateLimit(double max_rate, std::uint64_t bytes_per_second_max);

  // Whether a message of this size may pass now; if so, it is counted. `stamp`: the time that it
  // tells of, in ns; 0, or one that does not advance: the time of its arrival counts. The state of
  // a packet of a video is its camera.
  [[nodiscard]] bool admit(std::size_t bytes, Stamp stamp, TimePoint now, std::uint64_t state = 0,
                           VideoPart part = VideoPart::kNone);
  // The owner of the windows that the state's last message came to: a further state's are shared.
  // A refused message is held by this key, so no more are held than there are windows.
  [[nodiscard]] std::uint64_t key(std::uint64_t state) const;
  // When the message of this state that was refused last may leave after all, if no other one comes
  // until then: the state did not change for a period.
  [[nodiscard]] TimePoint leaves_at(std::uint64_t state = 0) const;
  // The refused message leaves now: count it.
  void leave(std::size_t bytes, TimePoint now, std::uint64_t state = 0);
  [[nodiscard]] bool has_rates_of(const RateLimit& other) const {
    return period_ == other.period_ && bytes_.rate() == other.bytes_.rate();
  }
  // Whether a message of any size would pass now, as if none had come before.
  [[nodiscard]] bool idle(TimePoint now) const;
  [[nodiscard]] std::size_t states() const { return states_.size(); }

 private:
  struct Windows {
    double credit = 1;           // messages that may pass
    double ahead = kAheadFirst;  // windows by which stamps may go on before the time here does
    Stamp stamp = 0;             // of the message before
    TimePoint arrived = TimePoint::min();
    std::uint32_t cut = 0;  // packets of a group that were refused since one was too much
    float fresh = 1;        // messages that new windows let pass at once
  };
  static constexpr double kAheadFirst = 3;
  // A limit of bytes alone needs no windows for each state.
  [[nodiscard]] std::uint64_t own_windows(std::uint64_t state) const {
    return period_ > 0 ? state : 0;
  }
  Windows& windows_of(std::uint64_t state, TimePoint now);
  // So many periods after its last message.
  [[nodiscard]] TimePoint after(const Windows& windows, double periods) const;
  void advance(Windows& windows, Stamp stamp, TimePoint now, double credit_max);
  [[nodiscard]] double window_of(Stamp ns) const;

  double period_ = 0;  // ns; 0: no limit
  std::map<std::uint64_t, Windows> states_;
  TimePoint idle_at_ = TimePoint::min();  // new windows would let no more pass than these
  Throttle bytes_;
};

// The rate limits of a topic's publishers.
class RateLimits {
 public:
  RateLimits() = default;  // no limit
  RateLimits(double max_rate, std::uint64_t bytes_per_second_max)
      : fresh_(max_rate, bytes_per_second_max) {}

  [[nodiscard]] RateLimit& of(OriginId origin) {
    return limits_.try_emplace(origin, fresh_).first->second;
  }
  void forget(OriginId origin) { limits_.erase(origin); }

 private:
  RateLimit fresh_;
  std::unordered_map<OriginId, RateLimit> limits_;
};

}  // namespace connect_bridge
