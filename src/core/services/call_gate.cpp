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
  Caller& state = callers_[caller];
  state.terms = terms;
  line_up(caller, state);
}

void CallGate::dismiss(LinkId caller) {
  Caller* const state = find(caller);
  if (!state) return;
  end_preparing(*state);
  if (state->in_turns) std::erase(turns_, caller);
  callers_.erase(caller);
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
  line_up(caller, *state);
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
  turns_.push_back(id);
}

// Turns without room wait until the server answers, or until it was silent for so long that its
// requests count as taken (deadline).
std::optional<CallGate::Next> CallGate::next(TimePoint now) {
  if (gone_) return std::nullopt;
  for (auto turn = turns_.begin(); turn != turns_.end();) {
    const LinkId id = *turn;
    Caller& caller = callers_.at(id);
    const bool may_begin = !caller.waiting.empty() && has_place(caller);
    // Callers whose rules set no limit for the queue do not wait behind callers whose rules do.
    if (may_begin && !queue_.has_room(caller.terms.queue_depth, preparing_, now)) {
      ++turn;
      continue;
    }
    turn = turns_.erase(turn);
    caller.in_turns = false;
    if (!may_begin) continue;
    const CallId call = *caller.waiting.begin();
    ++caller.taken;
    caller.waiting.erase(call);
    line_up(id, caller);
    return Next{id, call};
  }
  return std::nullopt;
}

// ---- what there is

CallGate::Caller* CallGate::find(LinkId caller) {
  const auto it = callers_.find(caller);
  return it == callers_.end() ? nullptr : &it->second;
}

bool CallGate::has_place(const Caller& caller) const {
  return !caller.preparing && caller.taken < (results_ ? kResultCallsMax : caller.terms.places);
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
