#include "core/driving/wheel.hpp"

#include <algorithm>
#include <utility>

#include "core/base/timers.hpp"

namespace connect_bridge::driving {
namespace {

// Programs such as `ros2 topic pub` repeat once a second, and a path adds jitter: more than that.
constexpr Duration kAlone = std::chrono::milliseconds(1500);
// Best effort may lose a zero.
constexpr int kZeros = 3;
constexpr Duration kZeroPeriod = std::chrono::milliseconds(80);
constexpr std::size_t kFlagsMax = 64;  // of a topic

bool contains(const std::vector<Gid>& origins, const Gid& origin) {
  return std::find(origins.begin(), origins.end(), origin) != origins.end();
}

// Samples of a stream may come late, or be lost: their publisher was not silent. Unknown: true.
bool are_apart(const SampleFacts& before, const SampleFacts& sample) {
  if (before.number == 0 || sample.number <= before.number) return true;
  if (!is_plausible(before.published) || !is_plausible(sample.published)) return true;
  if (sample.published < before.published) return false;
  const auto time = static_cast<std::uint64_t>(sample.published - before.published);
  return time / (sample.number - before.number) >= std::uint64_t{kAlone.count()};
}

}  // namespace

std::string_view name_of(WheelCause cause) {
  switch (cause) {
    case WheelCause::kMoved: return "moved";
    case WheelCause::kSilence: return "silence";
    case WheelCause::kAge: return "age";
    case WheelCause::kLinkLost: return "link_lost";
    case WheelCause::kRight: return "right";
    case WheelCause::kGiven: return "given";
    case WheelCause::kTaken: return "taken";
    case WheelCause::kStopped: return "stopped";
  }
  return "unknown";
}

// ---- what was seen of a publisher

// Only a sample that follows directly on the one before shows a pause: what was lost in between may
// have been a held stick.
void OriginSeen::note(const SampleFacts& sample, TimePoint now, Duration pause) {
  const bool follows = sample_ && sample_->connection == sample.connection &&
                       sample_->demand == sample.demand && sample_->number != 0 &&
                       sample.number == sample_->number + 1;  // mutant: pressed_anew
  noted_.alone = !sample_ || (now - at_ >= kAlone && are_apart(*sample_, sample));
  noted_.pressed = follows && is_plausible(sample_->published) && is_plausible(sample.published) &&
                   Duration(sample.published - sample_->published) >= pause;
  sample_ = sample;
  at_ = now;
}

// ---- the wheel

bool Wheel::is_mover(const Driver& who) const {
  if (!mover_) return false;
  return mover_->who.origin == Gid{} ? mover_->who.identity == who.identity
                                     : mover_->who.origin == who.origin;
}

bool Wheel::goes_on(const Said& said, TimePoint now) const {
  return is_held(now) && mover_->who.identity == said.who.identity &&
         (!mover_->moves || said.holder_gone);
}

WheelStep Wheel::on_command(const Said& said, const WheelRules& rules, TimePoint now) {
  WheelStep step;
  said.moves ? on_moving(said, rules, now, step) : on_neutral(said, now, step);
  return step;
}

void Wheel::on_moving(const Said& said, const WheelRules& rules, TimePoint now, WheelStep& step) {
  const Driver& who = said.who;
  if (const auto flag = find_flag(who, now); flag != flags_.end() && rules.let_go) {
    step.publishes = said.seen.pressed || !contains(flag->origins, who.origin);  // mutant: no_flag
    if (!step.publishes) return;
    flags_.erase(flag);
    step.cleared = true;
  }
  const bool same = is_mover(who) || goes_on(said, now);
  if (!same && is_held(now)) {  // mutant: one_holder
    step.publishes = false;
    return;
  }
  if (!same || !is_held(now)) {
    if (held_) release(WheelCause::kSilence, step);
    if (mover_ && mover_->moves && !same && mover_->who.identity != who.identity)
      flag(mover_->who, now, step);
    if (!same || !held_) mover_ = Mover{};
    step.events.push_back({WheelEvent::What::kTaken, who, WheelCause::kMoved, 0, {}});
  }
  held_ = true;
  zeros_.reset();  // they must not stop the new command
  Mover& mover = *mover_;
  mover.who = who;
  mover.rules = rules;
  // The frame is the peer's, and may be as long as a message.
  const bool is_small = said.raw.size() <= kLastCommandMax;
  mover.last = is_small ? Payload::copy_of(said.raw.view()) : Payload{};
  mover.moves = true;
  mover.was_old = false;
  mover.moved_at = mover.held_at = now;
  ++mover.commands;
  mover.oldest = std::max(mover.oldest, said.age);
}

// Somebody else's stop always works. A panel that repeats zeros does not stop the holder.
void Wheel::on_neutral(const Said& said, TimePoint now, WheelStep& step) {
  const Driver& who = said.who;
  if (const auto flag = find_flag(who, now);
      flag != flags_.end() &&
      (flag->who.origin == who.origin || said.seen.alone || !contains(flag->origins, who.origin))) {
    flags_.erase(flag);
    step.cleared = true;
  }
  if (is_mover(who)) {
    mover_->moves = false;
    return;
  }
  if (!is_held(now) || !mover_->moves) return;
  step.publishes = said.seen.alone;  // mutant: stream_of_zeros
  if (step.publishes) halt(WheelCause::kStopped, now, step);
}

WheelStep Wheel::on_time(TimePoint now) {
  WheelStep step;
  if (zeros_ && zeros_->next <= now) {
    step.zero = zeros_->zero;
    zeros_->next += kZeroPeriod;
    if (--zeros_->left == 0) zeros_.reset();
  }
  if (halts_at() <= now) halt(mover_->was_old ? WheelCause::kAge : WheelCause::kSilence, now, step);
  if (held_ && !is_held(now)) release(WheelCause::kSilence, step);
  return step;
}

WheelStep Wheel::on_end(const std::string& identity, LinkId link, WheelCause cause, TimePoint now) {
  WheelStep step;
  if (mover_ && mover_->who.link == link) {
    if (mover_->moves && mover_->rules.halt_after) halt(cause, now, step);
    if (held_) release(cause, step);
    mover_.reset();
  }
  for (Flag& flag : flags_)
    if (flag.who.identity == identity) flag.expires = now + kFlagKept;  // mutant: flag_of_the_link
  return step;
}

WheelStep Wheel::on_rule_without(LinkId link) {
  WheelStep step;
  if (!mover_ || mover_->who.link != link) return step;
  if (held_) release(WheelCause::kRight, step);
  if (zeros_ && zeros_->zero.origin == mover_->who.origin) zeros_.reset();
  mover_.reset();
  return step;
}

WheelStep Wheel::take(const Driver& who, TimePoint now) {
  WheelStep step;
  if (mover_ && mover_->who.identity == who.identity) {
    if (!is_held(now)) {
      if (held_) release(WheelCause::kSilence, step);
      step.events.push_back({WheelEvent::What::kTaken, who, WheelCause::kTaken, 0, {}});
    }
  } else {
    if (needs_halt(now))
      halt(WheelCause::kTaken, now, step);
    else if (mover_ && mover_->moves)
      flag(mover_->who, now, step);
    if (held_) release(WheelCause::kTaken, step);
    mover_ = Mover{};
    mover_->who = who;
    step.events.push_back({WheelEvent::What::kTaken, who, WheelCause::kTaken, 0, {}});
  }
  mover_->held_at = now;
  held_ = true;
  return step;
}

WheelStep Wheel::leave(const Driver& who, TimePoint now) {
  WheelStep step;
  if (!mover_ || mover_->who.identity != who.identity) return step;
  if (needs_halt(now)) halt(WheelCause::kGiven, now, step);
  if (held_) release(WheelCause::kGiven, step);
  return step;
}

void Wheel::halt(WheelCause cause, TimePoint now, WheelStep& step) {
  Mover& mover = *mover_;
  mover.moves = false;
  zeros_ = Zeros{{mover.who.origin, mover.last}, now, now + kZeroPeriod, kZeros - 1};
  step.zero = zeros_->zero;
  step.events.push_back(
      {WheelEvent::What::kHalted, mover.who, cause, mover.commands, mover.oldest});
  flag(mover.who, now, step);
}

void Wheel::release(WheelCause cause, WheelStep& step) {
  held_ = false;
  step.events.push_back(
      {WheelEvent::What::kLeft, mover_->who, cause, mover_->commands, mover_->oldest});
  mover_->commands = 0;
  mover_->oldest = Duration::zero();
}

// ---- flags

void Wheel::flag(const Driver& who, TimePoint now, WheelStep& step) {
  if (const auto known = find_flag(who, now); known != flags_.end()) flags_.erase(known);
  if (flags_.size() >= kFlagsMax) {
    std::erase_if(flags_, [&](const Flag& f) { return f.expires.has_value(); });
    if (flags_.size() >= kFlagsMax) flags_.erase(flags_.begin());
  }
  flags_.push_back({who, {who.origin}, {}});
  step.flagged.push_back(who.identity);
}

void Wheel::confine(const std::string& identity, std::vector<Gid> origins) {
  for (Flag& flag : flags_) {
    if (flag.who.identity != identity) continue;
    if (!contains(origins, flag.who.origin)) origins.push_back(flag.who.origin);
    flag.origins = std::move(origins);
    return;
  }
}

// By the identity, or by a publisher that another link feeds now.
std::vector<Wheel::Flag>::iterator Wheel::find_flag(const Driver& who, TimePoint now) {
  if (flags_.empty()) return flags_.end();
  std::erase_if(flags_, [&](const Flag& f) { return f.is_over(now); });
  const auto found = std::find_if(flags_.begin(), flags_.end(), [&](const Flag& f) {
    return f.who.identity == who.identity || f.who.origin == who.origin;
  });
  if (found != flags_.end()) found->expires.reset();
  return found;
}

bool Wheel::is_idle(TimePoint now) const {
  const bool flagged =
      std::any_of(flags_.begin(), flags_.end(), [&](const Flag& f) { return !f.is_over(now); });
  return !flagged && !zeros_ && !held_ && !(mover_ && mover_->moves);
}

// ---- times

TimePoint Wheel::halts_at() const {
  const bool halts = mover_ && mover_->moves && mover_->rules.halt_after;
  return halts ? mover_->moved_at + *mover_->rules.halt_after : TimePoint::max();
}

std::optional<TimePoint> Wheel::deadline() const {
  std::optional<TimePoint> first;
  if (zeros_) first = zeros_->next;
  if (halts_at() != TimePoint::max()) first = earliest(first, halts_at());
  if (held_) first = earliest(first, mover_->held_at + kWheelHeld);
  return first;
}

std::optional<TimePoint> Wheel::needs(const Gid& origin) const {
  if (halts_at() != TimePoint::max() && mover_->who.origin == origin)
    return halts_at() + kHaltLinger;
  if (zeros_ && zeros_->zero.origin == origin) return zeros_->began + kHaltLinger;
  return std::nullopt;
}

// ---- how it looks

WheelWord Wheel::word_for(const std::string& identity, TimePoint now) const {
  const bool flagged = std::any_of(flags_.begin(), flags_.end(), [&](const Flag& f) {
    return f.who.identity == identity && !f.is_over(now);
  });
  const bool own = mover_ && mover_->who.identity == identity;
  if (is_held(now) && !own) return WheelWord::kAnother;
  if (flagged) return WheelWord::kLetGo;
  return is_held(now) ? WheelWord::kYou : WheelWord::kNobody;
}

std::optional<Duration> Wheel::last_moved(TimePoint now) const {
  if (!mover_ || mover_->commands == 0) return std::nullopt;
  return now - mover_->moved_at;
}

}  // namespace connect_bridge::driving
