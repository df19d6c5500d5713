// The wheel of a topic: one peer steers at a time, and whoever was halted lets go first.
// docs/driving.md section "The wheel".
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/driving/command.hpp"

namespace connect_bridge::driving {

// A wheel is free when the last command that moves is this long ago.
inline constexpr Duration kWheelHeld = std::chrono::seconds(1);
// A mirror lives this long beyond the halt that it publishes.
inline constexpr Duration kHaltLinger = std::chrono::milliseconds(500);
// A key is pressed again if nothing was published for this time before, or for a shorter
// halt_after.
inline constexpr Duration kPressedAnew = std::chrono::milliseconds(500);
// A zero is made from a last command of at most this size, else without its frame and angle.
inline constexpr std::size_t kLastCommandMax = 1024;
// How long a flag outlives the link of its identity.
inline constexpr Duration kFlagKept = std::chrono::seconds(60);

// ---- what was seen of a publisher

// Facts about one sample, beside its content.
struct SampleFacts {
  ConnectionId connection;
  std::uint16_t demand = 0;
  std::uint64_t number = 0;  // 0: the middleware has none
  Stamp published = 0;
};

// The samples of one publisher, published here or dropped.
class OriginSeen {
 public:
  struct Noted {
    bool alone = true;     // no stream: it said nothing in the time before
    bool pressed = false;  // a key: nothing was published for a `pause` before
  };
  void note(const SampleFacts& sample, TimePoint now, Duration pause = kPressedAnew);
  // The facts about the last sample.
  [[nodiscard]] const Noted& last() const { return noted_; }

 private:
  std::optional<SampleFacts> sample_;
  TimePoint at_{};
  Noted noted_;
};

// ---- the wheel

// The sender of a command.
struct Driver {
  std::string identity;  // without a login: the peer's side
  LinkId link;
  Gid origin;          // all zero: none has said a command yet
  std::string rule{};  // that allows the commands
};

// The rule of a command, as far as the wheel needs it.
struct WheelRules {
  std::optional<Duration> halt_after;
  bool let_go = true;
};

// Why the state of a wheel has changed.
enum class WheelCause : std::uint8_t {
  kMoved,     // a command that moves
  kSilence,   // nothing came from the holder
  kAge,       // what came was too old
  kLinkLost,  // the holder's link has ended
  kRight,     // the holder's right has ended
  kGiven,     // the holder gave it away
  kTaken,     // another peer took it
  kStopped,   // another peer said neutral
};
[[nodiscard]] std::string_view name_of(WheelCause cause);

struct WheelEvent {
  enum class What : std::uint8_t { kTaken, kHalted, kLeft };
  What what = What::kTaken;
  Driver who;
  WheelCause cause = WheelCause::kMoved;
  std::uint64_t commands = 0;  // that move, published since the wheel was taken
  Duration oldest{0};          // of these
};

// The consequences of an input.
struct WheelStep {
  bool publishes = true;  // the sample; else it is dropped
  // A zero that the mirror of this publisher publishes, made from its last command.
  struct Zero {
    Gid origin;
    Payload last;
  };
  std::optional<Zero> zero;
  // Identities whose flag was set now: the caller says which publishers they offer (confine()).
  std::vector<std::string> flagged;
  std::vector<WheelEvent> events;
  bool cleared = false;  // a flag was cleared
};

// How a wheel looks to one identity.
enum class WheelWord : std::uint8_t { kNobody, kYou, kAnother, kLetGo };

// A value; its functions are its transitions. It is told about each command that is fresh, in
// order. Its timer is deadline().
class Wheel {
 public:
  // A command as it is published. `seen` includes it.
  struct Said {
    Driver who;
    OriginSeen::Noted seen;
    Payload raw;
    bool moves = true;
    Duration age{0};
    bool holder_gone = false;  // the publisher that moved the robot last has ended
  };
  [[nodiscard]] WheelStep on_command(const Said& said, const WheelRules& rules, TimePoint now);
  // A command of this publisher was dropped because of its age.
  void on_old(const Gid& origin) {
    if (mover_ && mover_->who.origin == origin) mover_->was_old = true;
  }
  [[nodiscard]] WheelStep on_time(TimePoint now);
  // The link has ended, or its right. `identity`: of the link.
  [[nodiscard]] WheelStep on_end(const std::string& identity, LinkId link, WheelCause cause,
                                 TimePoint now);
  // The rule of the link has no wheel any longer: nobody is halted.
  [[nodiscard]] WheelStep on_rule_without(LinkId link);
  // Another link goes on with the publisher that holds the wheel.
  void hand_over(LinkId link) { mover_->who.link = link; }
  [[nodiscard]] WheelStep take(const Driver& who, TimePoint now);
  [[nodiscard]] WheelStep leave(const Driver& who, TimePoint now);
  // The publishers that a flagged identity offers now. A publisher that comes later has let go.
  void confine(const std::string& identity, std::vector<Gid> origins);

  // The sender of the last command that moves, or of the last `take`; null: nobody.
  [[nodiscard]] const Driver* mover() const { return mover_ ? &mover_->who : nullptr; }
  // Nothing is left to do or to remember.
  [[nodiscard]] bool is_idle(TimePoint now) const;
  [[nodiscard]] std::optional<TimePoint> deadline() const;
  // The mirror of this publisher lives until then. nullopt: no halt needs it.
  [[nodiscard]] std::optional<TimePoint> needs(const Gid& origin) const;
  [[nodiscard]] WheelWord word_for(const std::string& identity, TimePoint now) const;
  // The age of the last command that moves.
  [[nodiscard]] std::optional<Duration> last_moved(TimePoint now) const;
  [[nodiscard]] bool is_held(TimePoint now) const {
    return held_ && now - mover_->held_at < kWheelHeld;  // mutant: free_at_once
  }

 private:
  // The sender of the last command that moves, or of the last `take`.
  struct Mover {
    Driver who;
    WheelRules rules;
    Payload last;  // command that moves; empty: it was too large to be kept
    bool moves = false;
    bool was_old = false;  // a command was too old since the last fresh one
    TimePoint moved_at{};
    TimePoint held_at{};  // the last command that moves, or a take
    std::uint64_t commands = 0;
    Duration oldest{0};
  };
  // An identity that lets go before it moves the robot again.
  struct Flag {
    Driver who;
    std::vector<Gid> origins;  // of the identity, when the flag was set
    std::optional<TimePoint> expires;

    [[nodiscard]] bool is_over(TimePoint now) const { return expires && *expires <= now; }
  };
  struct Zeros {
    WheelStep::Zero zero;
    TimePoint began;
    TimePoint next;
    int left = 0;
  };

  void on_moving(const Said& said, const WheelRules& rules, TimePoint now, WheelStep& step);
  void on_neutral(const Said& said, TimePoint now, WheelStep& step);
  [[nodiscard]] bool is_mover(const Driver& who) const;
  // Another publisher of the holder, which has let go of the one before.
  [[nodiscard]] bool goes_on(const Said& said, TimePoint now) const;
  // The mover still moves the robot, or would be halted for its silence.
  [[nodiscard]] bool needs_halt(TimePoint now) const {
    return mover_ && mover_->moves && (is_held(now) || mover_->rules.halt_after);
  }
  void halt(WheelCause cause, TimePoint now, WheelStep& step);
  void release(WheelCause cause, WheelStep& step);
  void flag(const Driver& who, TimePoint now, WheelStep& step);
  [[nodiscard]] std::vector<Flag>::iterator find_flag(const Driver& who, TimePoint now);
  [[nodiscard]] TimePoint halts_at() const;

  std::optional<Mover> mover_;
  bool held_ = false;  // the mover holds the wheel, or its time is over since a moment ago
  std::optional<Zeros> zeros_;
  std::vector<Flag> flags_;
};

}  // namespace connect_bridge::driving
