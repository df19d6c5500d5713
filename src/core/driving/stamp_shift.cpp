#include "core/driving/stamp_shift.hpp"

#include <algorithm>

namespace connect_bridge::driving {
namespace {

constexpr Duration kAgree = std::chrono::milliseconds(50);
// A stamp that is further from the time of publication is simulated time, or means something else.
constexpr Duration kApart = std::chrono::seconds(10);

Duration distance(Stamp a, Stamp b) {
  return Duration(a > b ? a - b : b - a);
}

}  // namespace

std::optional<Payload> shifted(const Command& command, ByteView sample, const ShiftFrom& from,
                               Stamp now) {
  if (command.stamp.at == 0) return std::nullopt;
  const auto stamp = stamp_of(sample, command.stamp);
  if (!stamp || *stamp == 0 || !is_plausible(from.published)) return std::nullopt;
  if (distance(*stamp, from.published) > kApart) return std::nullopt;  // mutant: far_stamps
  const Duration apart = std::chrono::abs(from.clock.offset);
  const bool agree = apart <= kAgree || apart <= from.clock.error_bound;
  const Stamp here = agree ? *stamp : *stamp - from.clock.offset.count();  // mutant: stamp_sign
  // The publisher's machine may be ahead of the peer's bridge.
  const Duration most = agree ? std::max(kAgree, from.clock.error_bound) : Duration::zero();
  const Stamp changed = here > now + most.count() ? now : here;  // mutant: stamp_of_the_future
  if (changed == *stamp) return std::nullopt;
  Bytes bytes(sample.begin(), sample.end());
  write_stamp(bytes, command.stamp, changed);
  return Payload::adopt(std::move(bytes));
}

AgeJudge::Verdict AgeJudge::judge(Duration age, Duration limit, const PeerClock& clock) {
  const bool too_young = age - youngest_ < -(clock.error_bound + kAgree);
  const bool too_old = age - youngest_ > limit;
  if (!too_young && !too_old) {
    doubt_.reset();
    if (is_ahead()) youngest_ = std::min(youngest_, age);
    return Verdict::kFresh;
  }
  // A publisher that was never ahead is right: its command is late.
  if (too_old && !is_ahead()) return Verdict::kOld;
  // Commands of a path that was blocked come faster than they were published, so they get younger.
  const bool stays =
      doubt_ && clock.replies > doubt_->replies && (too_young || age >= doubt_->age - kAgree);
  if (!stays) {
    if (!doubt_ || clock.replies > doubt_->replies) doubt_ = Doubt{clock.replies, age};
    return Verdict::kOld;
  }
  doubt_.reset();
  const bool was_ahead = is_ahead();
  youngest_ = std::min(Duration::zero(), age);
  if (age - youngest_ > limit) return Verdict::kOld;
  return was_ahead || !is_ahead() ? Verdict::kFresh : Verdict::kFreshAhead;
}

}  // namespace connect_bridge::driving
