#include "core/services/call_gate.hpp"

#include <algorithm>
#include <utility>

#include "core/services/calls.hpp"

namespace connect_bridge {
namespace {

// How long a server may give no answer before it is presumed to have taken the requests that it was
// given: for services, and for actions' results, whose requests are taken at once and answered when
// the goal ends.
constexpr Duration kSilenceMax = std::chrono::seconds(5);
constexpr Duration kResultSilenceMax = std::chrono::seconds(1);

}  // namespace

CallGate::Service::Service(bool is_results)
    : results(is_results), queue(is_results ? kResultSilenceMax : kSilenceMax) {}

// ---- services and callers

void CallGate::open(ServiceClientId service, bool results) {
  services_.try_emplace(service, results);
}

void CallGate::server_gone(ServiceClientId id) {
  Service* const service = find(id);
  if (!service) return;
  service->gone = true;
  service->queue.clear();
  service->timer.cancel();
}

void CallGate::close(ServiceClientId service) {
  services_.erase(service);
}

void CallGate::admit(const Caller& caller, const Terms& terms) {
  Service* const service = find(caller.service);
  if (!service) return;
  service->callers[caller.link].terms = terms;
  line_up(caller);
}

void CallGate::dismiss(const Caller& caller) {
  CallerState* const state = find(caller);
  if (!state) return;
  Service& service = *find(caller.service);
  if (state->preparing) --service.preparing;
  if (state->in_turns) std::erase(service.turns, caller.link);
  service.callers.erase(caller.link);
  due_.insert(caller.service);
}

// ---- calls

void CallGate::add(const Caller& caller, CallId call) {
  CallerState* const state = find(caller);
  if (!state) return;
  state->waiting.insert(call);
  line_up(caller);
}

void CallGate::preparing(const Caller& caller, CallId call) {
  CallerState* const state = find(caller);
  if (!state) return;
  state->preparing = call;
  ++find(caller.service)->preparing;
}

// The room that was reserved for a prepared call is taken by its request from now on. The next call
// of the caller may begin only now: a worker may be slow, and calls are handed over in their order.
void CallGate::handed_over(const Caller& caller, CallId call, InvocationId request, TimePoint now) {
  CallerState* const state = find(caller);
  if (!state) return;
  Service& service = *find(caller.service);
  service.queue.hand_over(request, now);
  if (state->preparing != call) return;
  state->preparing = {};
  --service.preparing;
  line_up(caller);
}

void CallGate::answered(ServiceClientId id, InvocationId request, TimePoint now) {
  Service* const service = find(id);
  if (!service) return;
  service->queue.answered(request, now);
  due_.insert(id);
}

void CallGate::failed(ServiceClientId id, InvocationId request) {
  Service* const service = find(id);
  if (!service) return;
  service->queue.failed(request);
  due_.insert(id);
}

// What was handed over stays in the server's queue: nobody can take it out again.
void CallGate::leave(const Caller& caller, CallId call) {
  CallerState* const state = find(caller);
  if (!state) return;
  if (state->waiting.erase(call) > 0) return;
  if (state->preparing == call) {
    state->preparing = {};
    --find(caller.service)->preparing;
  }
  --state->taken;
  line_up(caller);
}

// ---- what is next

void CallGate::line_up(const Caller& caller) {
  Service& service = *find(caller.service);
  CallerState& state = service.callers.at(caller.link);
  due_.insert(caller.service);
  if (state.in_turns || state.waiting.empty() || !has_place(service, state)) return;
  state.in_turns = true;
  service.turns.push_back(caller.link);
}

std::optional<CallGate::Next> CallGate::next(TimePoint now) {
  while (!held_ && !due_.empty()) {
    const ServiceClientId id = *due_.begin();
    if (auto found = next_of(id, now)) return found;
    due_.erase(id);
  }
  return std::nullopt;
}

// Without room it is looked at again when the server answers, or when it has been silent for so
// long that its requests count as taken (watch).
std::optional<CallGate::Next> CallGate::next_of(ServiceClientId id, TimePoint now) {
  Service* const service = find(id);
  if (!service || service->gone) return std::nullopt;
  auto& turns = service->turns;
  for (auto turn = turns.begin(); turn != turns.end();) {
    const Caller caller{*turn, id};
    CallerState& state = service->callers.at(caller.link);
    const bool may_begin = !state.waiting.empty() && has_place(*service, state);
    // Callers whose rules set no limit for the queue do not wait behind callers whose rules do.
    if (may_begin && !service->queue.has_room(state.terms.queue_depth, service->preparing, now)) {
      ++turn;
      continue;
    }
    turn = turns.erase(turn);
    state.in_turns = false;
    if (!may_begin) continue;
    const CallId call = *state.waiting.begin();
    ++state.taken;
    state.waiting.erase(call);
    line_up(caller);
    return Next{caller, call};
  }
  watch(id, *service);
  return std::nullopt;
}

void CallGate::expire(TimePoint now) {
  while (const auto service = timers_.take_due(now)) {
    // If callers still wait, next_of() sets it again for the requests that are left.
    services_.at(*service).timer.cancel();
    due_.insert(*service);
  }
}

// An answer that makes the deadline later leaves the timer as it is; it then fires once without
// effect.
void CallGate::watch(ServiceClientId id, Service& service) {
  const auto deadline = service.queue.deadline();
  if (service.turns.empty() || service.timer || !deadline) return;
  service.timer = timers_.set(*deadline, id);
}

// ---- what there is

CallGate::Service* CallGate::find(ServiceClientId service) {
  const auto it = services_.find(service);
  return it == services_.end() ? nullptr : &it->second;
}

CallGate::CallerState* CallGate::find(const Caller& caller) {
  Service* const service = find(caller.service);
  if (!service) return nullptr;
  const auto it = service->callers.find(caller.link);
  return it == service->callers.end() ? nullptr : &it->second;
}

bool CallGate::has_place(const Service& service, const CallerState& caller) {
  return !caller.preparing &&
         caller.taken < (service.results ? kResultCallsMax : caller.terms.places);
}

// For the limit of calls that wait: one that has a place is not refused because of the many of its
// link that have none.
bool CallGate::would_wait(const Caller& caller) const {
  const auto service = services_.find(caller.service);
  if (service == services_.end()) return true;
  const auto at = service->second.callers.find(caller.link);
  return at == service->second.callers.end() || !at->second.waiting.empty() ||
         !has_place(service->second, at->second);
}

std::size_t CallGate::waiting(const Caller& caller) const {
  const auto service = services_.find(caller.service);
  if (service == services_.end()) return 0;
  const auto at = service->second.callers.find(caller.link);
  return at == service->second.callers.end() ? 0 : at->second.waiting.size();
}

}  // namespace connect_bridge
