#include "core/services/call_gate.hpp"

#include <algorithm>
#include <utility>

#include "core/services/calls.hpp"

namespace connect_bridge {
namespace {

// The longest silence of a server before its requests are presumed taken. The second limit is for
// results of actions, whose requests are taken at once and answered when the goal ends.
constexpr Duration kSilenceMax = std::chrono::seconds(5);
constexpr Duration kResultSilenceMax = std::chrono::seconds(1);

}  // namespace

CallGate::CallGate(bool results)
    : results_(results), queue_(results ? kResultSilenceMax : kSilenceMax) {}

// ---- the server and callers

void CallGate::server_gone() {
  gone_ = true;
  queue_.clear();
}

void CallGate::admit(LinkId caller, const Terms& terms) {
  Caller* known = find(caller);
  if (known && known->terms.identity != terms.identity) quit(caller, *known);
  Caller& state = callers_[caller];
  state.terms = terms;
  Group& group = groups_[terms.identity];
  if (group.members.insert(caller).second) group.taken += state.taken;
  line_up_all(group);
}

void CallGate::dismiss(LinkId caller) {
  Caller* const state = find(caller);
  if (!state) return;
  end_preparing(*state);
  quit(caller, *state);
  callers_.erase(caller);
}

// The links that stay may use its places.
void CallGate::quit(LinkId id, Caller& caller) {
  const std::uint64_t identity = caller.terms.identity;
  Group& group = groups_.at(identity);
  group.taken -= caller.taken;
  group.members.erase(id);
  if (std::exchange(caller.in_turns, false)) std::erase(group.turns, id);
  if (group.turns.empty()) std::erase(turns_, identity);
  line_up_all(group);
  if (group.members.empty()) groups_.erase(identity);
}

// ---- calls

void CallGate::add(LinkId caller, CallId call) {
  Caller* const state = find(caller);
  if (!state) return;
  state->waiting.insert(call);
  line_up(caller, *state);
}

void CallGate::preparing(LinkId caller, CallId call) {
  Caller* const state = find(caller);
  if (!state) return;
  state->preparing = call;
  ++preparing_;
}

// Room that was reserved for a prepared call now belongs to its request. The caller's next call
// begins only now: a worker may be slow, and calls are handed over in their order.
void CallGate::handed_over(LinkId caller, CallId call, InvocationId request, TimePoint now) {
  Caller* const state = find(caller);
  if (!state) return;
  queue_.hand_over(request, now);
  if (state->preparing != call) return;
  end_preparing(*state);
  line_up(caller, *state);
}

// Requests that were handed over stay in the server's queue: nobody can take them out again.
void CallGate::leave(LinkId caller, CallId call) {
  Caller* const state = find(caller);
  if (!state || state->waiting.erase(call) > 0) return;
  if (state->preparing == call) end_preparing(*state);
  --state->taken;
  Group& group = groups_.at(state->terms.identity);
  --group.taken;
  line_up_all(group);
}

void CallGate::end_preparing(Caller& caller) {
  if (!caller.preparing) return;
  caller.preparing = {};
  --preparing_;
}

// ---- what is next

void CallGate::line_up(LinkId id, Caller& caller) {
  if (caller.in_turns || caller.waiting.empty() || !has_place(caller)) return;
  caller.in_turns = true;
  Group& group = groups_.at(caller.terms.identity);
  if (group.turns.empty()) turns_.push_back(caller.terms.identity);
  group.turns.push_back(id);
}

void CallGate::line_up_all(const Group& group) {
  for (const LinkId member : group.members) line_up(member, callers_.at(member));
}

// Turns without room wait until the server answers, or until it was silent for so long that its
// requests count as taken (deadline).
std::optional<CallGate::Next> CallGate::next(TimePoint now) {
  if (gone_) return std::nullopt;
  for (std::size_t at = 0; at < turns_.size();) {
    const std::uint64_t identity = turns_[at];
    Group& group = groups_.at(identity);
    for (auto turn = group.turns.begin(); turn != group.turns.end();) {
      const LinkId id = *turn;
      Caller& caller = callers_.at(id);
      const bool may_begin = !caller.waiting.empty() && has_place(caller);
      // Callers whose rules set no limit for the queue do not wait behind callers whose rules do.
      if (may_begin && !queue_.has_room(caller.terms.queue_depth, preparing_, now)) {
        ++turn;
        continue;
      }
      turn = group.turns.erase(turn);
      caller.in_turns = false;
      if (!may_begin) continue;
      const CallId call = *caller.waiting.begin();
      ++caller.taken;
      ++group.taken;
      caller.waiting.erase(call);
      // Behind all others: the identity, and the link among those of its identity.
      turns_.erase(turns_.begin() + static_cast<std::ptrdiff_t>(at));  // mutant: gate_identities
      if (!group.turns.empty()) turns_.push_back(identity);
      line_up(id, caller);
      wait_.reset();
      return Next{id, call};
    }
    if (group.turns.empty()) {
      turns_.erase(turns_.begin() + static_cast<std::ptrdiff_t>(at));
    } else {
      ++at;
    }
  }
  note_wait(now);
  return std::nullopt;
}

void CallGate::note_wait(TimePoint now) {
  const bool waits = std::any_of(callers_.begin(), callers_.end(), [](const auto& caller) {
    return !caller.second.waiting.empty() && !caller.second.preparing;
  });
  const Obstacle obstacle = turns_.empty() ? Obstacle::kPlaces : Obstacle::kQueue;
  if (!waits) return wait_.reset();
  if (!wait_) wait_ = Wait{now};
  wait_->obstacle = obstacle;
}

// ---- what there is

CallGate::Caller* CallGate::find(LinkId caller) {
  const auto it = callers_.find(caller);
  return it == callers_.end() ? nullptr : &it->second;
}

bool CallGate::has_place(const Caller& caller) const {
  if (caller.preparing) return false;
  if (results_) return caller.taken < kResultCallsMax;
  // Links of one identity may be people who know nothing of each other.
  return caller.taken == 0 || groups_.at(caller.terms.identity).taken < caller.terms.places;
}

// The limit of waiting calls uses this answer: a call with a place is not refused because its link
// has many calls without one.
bool CallGate::would_wait(LinkId caller) const {
  const auto at = callers_.find(caller);
  return at == callers_.end() || !at->second.waiting.empty() || !has_place(at->second);
}

std::size_t CallGate::waiting(LinkId caller) const {
  const auto at = callers_.find(caller);
  return at == callers_.end() ? 0 : at->second.waiting.size();
}

}  // namespace connect_bridge
