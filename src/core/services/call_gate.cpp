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

// ---- links and callers

void CallGate::open(ServiceClientId service, bool results) {
  services_.try_emplace(service, results);
}

void CallGate::server_gone(ServiceClientId service) {
  const auto it = services_.find(service);
  if (it == services_.end()) return;
  // Its callers are dismissed one after the other, and what each gives back goes to others at once:
  // none of those that are still there may be handed over then.
  it->second.placed.clear();
  it->second.queue.clear();
  it->second.timer.cancel();
}

void CallGate::close(ServiceClientId service) {
  services_.erase(service);
}

void CallGate::admit(const Caller& caller, const Terms& terms) {
  callers_[caller].terms = terms;
  (void)links_[caller.link];
}

void CallGate::dismiss(const Caller& caller) {
  const auto at = find(caller);
  if (!at) return;
  auto& [unused, state, service, link] = *at;
  link.waiting -= state.waiting.size();
  // The first of them took no place of the link, see passes_link().
  if (!service.results && state.taken > 0) link.taken -= state.taken - 1;
  std::erase(link.turns, caller.service);
  std::erase(service.placed, caller);
  if (state.preparing) --service.preparing;
  callers_.erase(caller);
  mark(caller);
}

void CallGate::close(LinkId link) {
  if (const auto it = links_.find(link); it != links_.end()) it->second.closed = true;
}

void CallGate::forget(LinkId link) {
  links_.erase(link);
}

// ---- calls

void CallGate::add(const Caller& caller, CallId call) {
  const auto at = find(caller);
  if (!at) return;
  at->state.waiting.insert(call);
  ++at->link.waiting;
  mark(caller);
}

void CallGate::preparing(const Caller& caller, CallId call) {
  const auto at = find(caller);
  if (!at) return;
  at->state.preparing = call;
  ++at->service.preparing;
}

// The room that was reserved for a prepared call is taken by its request from now on. The next call
// of the caller may begin only now: a worker may be slow, and calls are handed over in their order.
void CallGate::handed_over(const Caller& caller, CallId call, InvocationId request, TimePoint now) {
  const auto at = find(caller);
  if (!at) return;
  at->service.queue.hand_over(request, now);
  if (at->state.preparing != call) return;
  at->state.preparing = {};
  --at->service.preparing;
  mark(caller);
}

void CallGate::answered(ServiceClientId service, InvocationId request, TimePoint now) {
  const auto it = services_.find(service);
  if (it == services_.end()) return;
  it->second.queue.answered(request, now);
  mark({{}, service});
}

void CallGate::failed(ServiceClientId service, InvocationId request) {
  const auto it = services_.find(service);
  if (it != services_.end()) it->second.queue.failed(request);
}

// What was handed over stays in the server's queue: nobody can take it out again.
void CallGate::leave(const Caller& caller, CallId call) {
  const auto at = find(caller);
  if (!at) return;
  if (at->state.waiting.erase(call) > 0) {
    --at->link.waiting;
  } else {
    if (at->state.placed == call) {
      std::erase(at->service.placed, caller);
      at->state.placed = {};
    } else if (at->state.preparing == call) {
      at->state.preparing = {};
      --at->service.preparing;
    }
    free_place(*at);
  }
  mark(caller);
}

void CallGate::free_place(const Found& at) {
  // In this order, as in take_place(): passes_link() is asked without the place in question, so
  // that the link gets back exactly the places that it gave.
  --at.state.taken;
  if (!passes_link(at)) --at.link.taken;
}

// ---- what is next

void CallGate::consider(const Caller& caller) {
  mark(caller);
}

void CallGate::mark(const Caller& caller) {
  // What is marked while the gate is held is not remembered: whoever releases it considers all
  // callers (ServiceExports::go_on). Several changes of one caller in a row need one look.
  if (!held_ && (due_.empty() || due_.back() != caller)) due_.push_back(caller);
}

// First the server's queue is filled from the placed calls, because they came first; then the free
// places of the link are given out. When a placed call is handed over, its caller may place its
// next one, behind those of the other callers, before the queue is filled again.
std::optional<CallGate::Next> CallGate::next(TimePoint now) {
  while (!held_ && (sharing_ || !due_.empty())) {
    if (sharing_) {
      if (auto found = share_places(*sharing_, now)) return found;
      sharing_.reset();
    } else if (auto found = let_in(due_.front().service, now)) {
      return found;
    } else {
      if (due_.front().link) sharing_ = due_.front();
      due_.pop_front();
    }
  }
  return std::nullopt;
}

// Without room it is looked at again when the server answers, or when it has been silent for so
// long that its requests count as taken (watch). A caller that is let in shares places next: it has
// none placed now, so its next call may line up behind those of other links.
std::optional<CallGate::Next> CallGate::let_in(ServiceClientId id, TimePoint now) {
  const auto it = services_.find(id);
  if (it == services_.end()) return std::nullopt;
  Service& service = it->second;
  if (service.placed.empty() || !has_room(callers_.at(service.placed.front()), service, now)) {
    watch(id, service);
    return std::nullopt;
  }
  const Caller caller = service.placed.front();
  service.placed.pop_front();
  sharing_ = caller;
  return Next{caller, std::exchange(callers_.at(caller).placed, {})};
}

std::optional<CallGate::Next> CallGate::share_places(Caller caller, TimePoint now) {
  const auto link = links_.find(caller.link);
  if (link == links_.end() || link->second.closed) return std::nullopt;
  if (const auto at = find(caller)) {
    // What takes no place of the link waits for no turn: a caller's only call, and calls for
    // results. So a link whose places are all taken by services that never answer can still call
    // each other one.
    while (passes_link(*at) && !at->state.waiting.empty() && has_place(at->state, at->service))
      if (auto found = take_place(*at, now)) return found;
    line_up(*at);
  }
  // One call of each service, and then to the end of the line, if it has more: a service with a
  // thousand calls that wait keeps no other one of its link from its turn.
  auto& turns = link->second.turns;
  while (!turns.empty() && link->second.taken < link_places_) {
    const Caller next{caller.link, turns.front()};
    turns.pop_front();
    const auto at = find(next);
    if (!at) continue;
    at->state.in_turns = false;
    if (at->state.waiting.empty() || !has_place(at->state, at->service)) continue;
    if (auto found = take_place(*at, now)) return found;
    line_up(*at);
  }
  return std::nullopt;
}

void CallGate::line_up(const Found& at) {
  if (at.state.in_turns || at.service.results || at.state.waiting.empty() ||
      !has_place(at.state, at.service))
    return;
  at.state.in_turns = true;
  at.link.turns.push_back(at.caller.service);
}

std::optional<CallGate::Next> CallGate::take_place(const Found& at, TimePoint now) {
  const Caller caller = at.caller;
  const CallId call = *at.state.waiting.begin();
  at.state.waiting.erase(call);
  --at.link.waiting;
  if (!passes_link(at)) ++at.link.taken;
  ++at.state.taken;
  // Callers whose rules set no limit for the queue do not wait behind callers whose rules do.
  const bool is_first = at.service.placed.empty() || at.state.terms.queue_depth == 0;
  if (is_first && has_room(at.state, at.service, now)) {
    sharing_ = caller;
    return Next{caller, call};
  }
  at.state.placed = call;
  at.service.placed.push_back(caller);
  watch(caller.service, at.service);
  return std::nullopt;
}

void CallGate::expire(TimePoint now) {
  while (const auto service = timers_.take_due(now)) {
    // If callers still wait, let_in() sets it again for the requests that are left.
    services_.at(*service).timer.cancel();
    mark({{}, *service});
  }
}

// An answer that makes the deadline later leaves the timer as it is; it then fires once without
// effect.
void CallGate::watch(ServiceClientId id, Service& service) {
  const auto deadline = service.queue.deadline();
  if (service.placed.empty() || service.timer || !deadline) return;
  service.timer = timers_.set(*deadline, id);
}

// ---- what there is

std::optional<CallGate::Found> CallGate::find(const Caller& caller) {
  const auto state = callers_.find(caller);
  const auto service = services_.find(caller.service);
  if (state == callers_.end() || service == services_.end()) return std::nullopt;
  // admit() has made the link's entry, which is forgotten after all its callers are dismissed.
  return Found{state->first, state->second, service->second, links_.at(caller.link)};
}

bool CallGate::has_place(const CallerState& state, const Service& service) {
  if (state.placed || state.preparing) return false;
  return state.taken < (service.results ? kResultCallsMax : state.terms.places);
}

bool CallGate::passes_link(const Found& at) {
  return at.service.results || at.state.taken == 0;
}

bool CallGate::has_room(const CallerState& state, Service& service, TimePoint now) {
  return service.queue.has_room(state.terms.queue_depth, service.preparing, now);
}

// For the limit of calls that wait: one that can be placed at once is not refused because of the
// many of its link that cannot.
bool CallGate::would_wait(const Caller& caller) {
  const auto at = find(caller);
  return !at || !has_place(at->state, at->service) || !at->state.waiting.empty() ||
         (at->link.taken >= link_places_ && !passes_link(*at));
}

std::size_t CallGate::waiting(LinkId link) const {
  const auto it = links_.find(link);
  return it == links_.end() ? 0 : it->second.waiting;
}

std::size_t CallGate::waiting(const Caller& caller) const {
  const auto it = callers_.find(caller);
  return it == callers_.end() ? 0 : it->second.waiting.size() + (it->second.placed ? 1 : 0);
}

}  // namespace connect_bridge
