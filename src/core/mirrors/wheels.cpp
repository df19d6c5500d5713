#include "core/mirrors/wheels.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/hex.hpp"
#include "core/link/link_audit.hpp"
#include "core/mirrors/import_context.hpp"
#include "core/mirrors/peer_topic.hpp"

namespace connect_bridge {
namespace {

// More wheels than this stay only while their topics are offered.
constexpr std::size_t kWheelsKept = 256;
// Before the side of a peer without a login. No identity has a control character in its name.
constexpr std::string_view kSide = "\n";
// docs/protocol.md, "Limits".
constexpr Duration kSentPeriod = std::chrono::milliseconds(250);

std::vector<Gid> origins_of(const ImportContext& context, const TopicKey& key,
                            const std::string& driver) {
  std::vector<Gid> found;
  for (const auto& [origin, mirror] : context.mirrors.of(key))
    if (std::ranges::any_of(mirror.candidates(),
                            [&](const MirrorCandidate& c) { return driver_of(*c.link) == driver; }))
      found.push_back(origin.second);
  return found;
}

AuditEvent event_of(driving::WheelEvent::What what) {
  switch (what) {
    case driving::WheelEvent::What::kTaken: return AuditEvent::kWheelTaken;
    case driving::WheelEvent::What::kHalted: return AuditEvent::kHalted;
    case driving::WheelEvent::What::kLeft: break;
  }
  return AuditEvent::kWheelLeft;
}

void tell(Outputs& outputs, const TopicKey& key, const driving::WheelEvent& event) {
  if (!outputs.audits()) return;
  Audit line;
  line.event = event_of(event.what);
  line.link = event.who.link;
  if (!event.who.identity.starts_with(kSide)) line.identity = event.who.identity;
  line.channel = AuditChannel{Direction::kImport, InterfaceKind::kTopic, key.first, key.second,
                              event.who.rule};
  line.code = name_of(event.cause);
  if (event.what != driving::WheelEvent::What::kTaken)
    line.reason = std::to_string(event.commands) + " commands, the oldest " +
                  std::to_string(event.oldest / std::chrono::milliseconds(1)) + " ms old";
  outputs.push(std::move(line));
}

// The word of the wire.
WheelState state_of(driving::WheelWord word) {
  switch (word) {
    case driving::WheelWord::kNobody: break;
    case driving::WheelWord::kYou: return WheelState::kYours;
    case driving::WheelWord::kAnother: return WheelState::kTaken;
    case driving::WheelWord::kLetGo: return WheelState::kHalted;
  }
  return WheelState::kFree;
}

void log_drop(Outputs& outputs, const Link& link, const TopicKey& key, driving::WheelWord word) {
  const std::string_view why =
      word == driving::WheelWord::kLetGo ? "it was halted, and has to let go first"
      : word == driving::WheelWord::kYou ? "another publisher of the same operator drives"
                                         : "another peer drives";
  outputs.log_once(
      link.account->logged, LogLevel::kWarn,
      "commands of " + link.label() + " on " + key.first + " are dropped: " + std::string(why));
}

}  // namespace

std::string driver_of(const Link& link) {
  const std::string& name = link.login.identity().name;
  return name.empty() ? std::string(kSide) + to_hex(link.peer().side.bytes) : name;
}

bool Wheels::judge(ImportContext& context, TopicMirror& mirror, const Link& link,
                   const SteeringCommand& command, const Now& now) {
  const TopicKey& key = mirror.key().first;
  auto found = wheels_.find(key);
  if (found == wheels_.end()) {
    if (!command.moves) return true;
    found = open(context, key, now);
  }
  Entry& entry = found->second;
  entry.type = command.type;
  const driving::Driver who{driver_of(link), link.id, mirror.key().second, command.rule};
  const driving::Driver* const mover = entry.wheel.mover();
  const TopicMirror* const holder = mover ? context.mirrors.find({key, mover->origin}) : nullptr;
  const bool gone = !holder || holder->candidates().empty();
  auto step = entry.wheel.on_command(
      {who, mirror.steered().seen.last(), command.raw, command.moves, command.age, gone},
      command.rules, now.steady);
  const bool publishes = step.publishes;
  if (!publishes)
    log_drop(context.outputs, link, key, entry.wheel.word_for(who.identity, now.steady));
  follow(context, found, std::move(step), now);
  return publishes;
}

void Wheels::on_old(const TopicMirror& mirror) {
  if (const auto found = wheels_.find(mirror.key().first); found != wheels_.end())
    found->second.wheel.on_old(mirror.key().second);
}

void Wheels::on_link_end(ImportContext& context, const Link& link, const Now& now) {
  for (auto it = wheels_.begin(); it != wheels_.end(); ++it)
    end(context, it, link, driving::WheelCause::kLinkLost, now);
  forget_idle(now);
}

void Wheels::on_right_end(ImportContext& context, const TopicKey& key, const Link& link,
                          const Now& now) {
  if (const auto found = wheels_.find(key); found != wheels_.end())
    end(context, found, link, driving::WheelCause::kRight, now);
}

void Wheels::on_rule_without(ImportContext& context, const TopicKey& key, const Link& link,
                             const Now& now) {
  if (const auto found = wheels_.find(key); found != wheels_.end())
    follow(context, found, found->second.wheel.on_rule_without(link.id), now);
}

// A second link that offers the publisher goes on as its feeder.
void Wheels::end(ImportContext& context, Found wheel, const Link& link, driving::WheelCause cause,
                 const Now& now) {
  const driving::Driver* const mover = wheel->second.wheel.mover();
  if (mover && mover->link == link.id) {
    if (const TopicMirror* const mirror = context.mirrors.find({wheel->first, mover->origin})) {
      const auto& candidates = mirror->candidates();
      const auto next = std::ranges::find_if(candidates, [&](const MirrorCandidate& c) {
        return c.link->id != link.id && c.is_usable();
      });
      if (next != candidates.end()) wheel->second.wheel.hand_over(next->link->id);
    }
  }
  follow(context, wheel, wheel->second.wheel.on_end(driver_of(link), link.id, cause, now.steady),
         now);
}

void Wheels::on_wanted(ImportContext& context, const TopicKey& key, const Link& link,
                       WheelWant want, const std::string& rule, const Now& now) {
  const Found found = open(context, key, now);
  Entry& entry = found->second;
  entry.type = *driving::command_type(key.second);
  const driving::Driver who{driver_of(link), link.id, {}, rule};
  follow(context, found,
         want == WheelWant::kTake ? entry.wheel.take(who, now.steady)
                                  : entry.wheel.leave(who, now.steady),
         now);
}

void Wheels::on_offered(const TopicKey& key, const Now& now) {
  const auto found = wheels_.find(key);
  if (found == wheels_.end()) return;
  found->second.to_tell = true;
  found->second.timer = timers_.set(now.steady, &found->first);
}

void Wheels::on_stop(ImportContext& context, const Now& now) {
  for (auto it = wheels_.begin(); it != wheels_.end(); ++it)
    if (it->second.wheel.mover()) {
      const driving::Driver who = *it->second.wheel.mover();  // a copy: the mover ends
      follow(context, it,
             it->second.wheel.on_end(who.identity, who.link, driving::WheelCause::kLinkLost,
                                     now.steady),
             now);
    }
}

void Wheels::on_time(ImportContext& context, const Now& now) {
  while (const auto due = timers_.take_due(now.steady)) {
    const Found found = wheels_.find(**due);
    found->second.timer.cancel();
    follow(context, found, found->second.wheel.on_time(now.steady), now);  // mutant: halt_clock
  }
}

void Wheels::follow(ImportContext& context, Found wheel, driving::WheelStep step, const Now& now) {
  const auto& [key, entry] = *wheel;
  if (step.zero)
    if (TopicMirror* const mirror = context.mirrors.find({key, step.zero->origin}))
      mirror->halt(driving::halt_after(entry.type, step.zero->last.view(),
                                       context.has_simulated_time() ? Stamp{0} : now.system),
                   now);
  for (const std::string& identity : step.flagged)
    wheel->second.wheel.confine(identity, origins_of(context, key, identity));
  for (const auto& event : step.events) tell(context.outputs, key, event);
  // A neutral clears a flag without an event.
  wheel->second.to_tell = entry.to_tell || !step.events.empty() || step.cleared;
  tell_peers(context, wheel, now);
  set_timer(wheel);
}

void Wheels::tell_peers(ImportContext& context, Found wheel, const Now& now) {
  Entry& entry = wheel->second;
  if (!entry.to_tell || now.steady - entry.sent_at < kSentPeriod) return;
  entry.to_tell = false;
  entry.sent_at = now.steady;
  const TopicKey& key = wheel->first;
  for (const auto& [origin, mirror] : context.mirrors.of(key))
    for (const MirrorCandidate& candidate : mirror.candidates())
      if (candidate.offered)
        candidate.offered->tell_wheel(
            state_of(entry.wheel.word_for(driver_of(*candidate.link), now.steady)));
}

// Each command moves the deadline: a timer that is early looks again.
void Wheels::set_timer(Found wheel) {
  Entry& entry = wheel->second;
  auto at = entry.wheel.deadline();
  if (entry.to_tell) at = earliest(at, entry.sent_at + kSentPeriod);
  if (!at) return entry.timer.cancel();
  if (!entry.timer || *at < entry.timer.at()) entry.timer = timers_.set(*at, &wheel->first);
}

// A command that moves is never dropped because there are many wheels: each topic that is offered
// may have one.
Wheels::Found Wheels::open(const ImportContext& context, const TopicKey& key, const Now& now) {
  if (!wheels_.contains(key) && wheels_.size() >= kWheelsKept) {
    forget_idle(now);
    std::erase_if(wheels_, [&](auto& named) {
      return !named.second.wheel.is_held(now.steady) && context.mirrors.of(named.first).empty();
    });
  }
  return wheels_.try_emplace(key).first;
}

void Wheels::forget_idle(const Now& now) {
  std::erase_if(wheels_, [&](auto& named) { return named.second.wheel.is_idle(now.steady); });
}

std::optional<TimePoint> Wheels::needs(const TopicMirror& mirror) const {
  const driving::Wheel* const wheel = find(mirror.key().first);
  return wheel ? wheel->needs(mirror.key().second) : std::nullopt;
}

const driving::Wheel* Wheels::find(const TopicKey& key) const {
  const auto found = wheels_.find(key);
  return found == wheels_.end() ? nullptr : &found->second.wheel;
}

}  // namespace connect_bridge
