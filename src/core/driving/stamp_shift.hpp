// Stamps of commands in the clock of this machine, and the age of commands. Pure functions.
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/bytes.hpp"
#include "core/base/time.hpp"
#include "core/driving/command.hpp"

namespace connect_bridge::driving {

// The measured clock of the other machine. The true offset is within the bound.
struct PeerClock {
  Duration offset{0};  // the peer's system clock minus ours
  Duration error_bound{0};
  std::uint64_t replies = 0;  // rises with each reply that measured it
};

// Receivers judge the age of a command by its stamp and their own clock.
struct ShiftFrom {
  PeerClock clock;
  Stamp published = 0;  // by the sample's own machine; 0: unknown
};

// The sample with its stamp in our clock, and never later than `now`. nullopt: the sample stays as
// it is. Clocks that agree within 50 ms change no byte, and a zero stamp is none.
[[nodiscard]] std::optional<Payload> shifted(const Command& command, ByteView sample,
                                             const ShiftFrom& from, Stamp now);

// Judges the age of the commands of one publisher. Its machine's clock may differ from that of the
// peer's bridge, whose offset is known. A clock may also be set between two replies.
class AgeJudge {
 public:
  enum class Verdict : std::uint8_t {
    kFresh,
    kOld,        // older than the limit, or it cannot be judged before the next reply
    kFreshAhead  // fresh, and the first one since the publisher's clock is known to be ahead
  };
  // `age`: by the clock of the bridge.
  [[nodiscard]] Verdict judge(Duration age, Duration limit, const PeerClock& clock);
  // The age since the youngest command of a publisher whose clock is ahead.
  [[nodiscard]] Duration corrected(Duration age) const { return age - youngest_; }
  [[nodiscard]] bool is_ahead() const { return youngest_ < Duration::zero(); }

 private:
  struct Doubt {
    std::uint64_t replies = 0;
    Duration age{0};
  };
  Duration youngest_{0};  // below zero: the publisher's clock is ahead by this
  std::optional<Doubt> doubt_;
};

}  // namespace connect_bridge::driving
