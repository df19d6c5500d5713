// Calls that wait and calls that are under way: a call takes a place of its link and one of its
// service, and is handed over when the server's queue has room for it.
#include <algorithm>

#include "core/compress/compress.hpp"
#include "core/link/options.hpp"
#include "core/services/service_exports.hpp"

namespace connect_bridge {

// Requests are decompressed one after the other, so that they reach the server in their order.
bool ServiceExports::has_place(const Served& served) const {
  if (served.in_line || served.decoding || !served.service->client) return false;
  if (served.service->results) return served.in_flight < kResultCallsMax;
  return served.in_flight < served.decision.treatment.calls_max;
}

bool ServiceExports::has_room(const Served& served, const Now& now) {
  Service& s = *served.service;
  return s.client &&
         s.queue.has_room(served.decision.treatment.server_queue, s.decoding, now.steady);
}

void ServiceExports::go_on(const Now& now) {
  holds_ = false;
  for (auto& [key, service] : services_)
    for (auto& [id, served] : service.links)
      if (!served.calls.empty()) resume(served, now);
}

void ServiceExports::resume(Served& served, const Now& now) {
  if (holds_) return;
  let_in(*served.service, now);
  share_places(served, now);
}

// A link has one call in the line, so links take turns.
void ServiceExports::let_in(Service& service, const Now& now) {
  while (!service.line.empty() && has_room(*service.line.front(), now)) {
    Served& next = *service.line.front();
    service.line.pop_front();
    start(next, std::exchange(next.in_line, {}), now);
    share_places(next, now);
  }
  watch_line(service);
}

void ServiceExports::share_places(Served& served, const Now& now) {
  while (served.service->results && !served.waiting.empty() && has_place(served))
    take_place(served, now);
  PeerLoad& load = load_of(served);
  const auto line_up = [&](Served& s) {
    if (s.hungry || s.service->results || s.waiting.empty() || !has_place(s)) return;
    s.hungry = true;
    load.hungry.push_back(&s);
  };
  line_up(served);
  while (!load.hungry.empty() && load.in_flight < options_.calls_max) {
    Served& next = *load.hungry.front();
    load.hungry.pop_front();
    next.hungry = false;
    if (next.waiting.empty() || !has_place(next)) continue;
    take_place(next, now);
    line_up(next);
  }
}

void ServiceExports::take_place(Served& served, const Now& now) {
  const CallId id = *served.waiting.begin();
  PeerLoad& load = load_of(served);
  served.waiting.erase(id);
  --load.waiting;
  ++served.in_flight;
  if (!served.service->results) ++load.in_flight;
  Service& service = *served.service;
  const bool first = service.line.empty() || served.decision.treatment.server_queue == 0;
  if (first && has_room(served, now)) return start(served, id, now);
  served.calls.at(id).state = CallState::kInLine;
  served.in_line = id;
  service.line.push_back(&served);
  watch_line(service);
}

// An answer that moves the deadline away leaves the timer as it is; it fires for nothing once.
void ServiceExports::watch_line(Service& service) {
  const auto deadline = service.queue.deadline();
  if (service.line.empty() || service.line_timer || !deadline) return;
  service.line_timer = TimerKey{*deadline, ++last_timer_};
  line_timers_[*service.line_timer] = &service;
}

void ServiceExports::end_line(Service& service) {
  service.line.clear();
  service.queue.clear();
  if (service.line_timer) line_timers_.erase(*std::exchange(service.line_timer, {}));
}

void ServiceExports::start(Served& served, CallId id, const Now& now) {
  Call& call = served.calls.at(id);
  load_of(served).request_bytes -= call.request.body.size();
  call.state = CallState::kDecoding;
  const InMessage request = std::move(call.request);
  call.request = {};
  if (request.codec == Codec::kNone) return invoke(served, id, call, request.body, now);
  if (request.raw_bytes >= options_.compress_job_bytes) {
    call.job = outputs_.new_job();
    jobs_[call.job] = {&served, id};
    served.decoding = id;
    ++served.service->decoding;
    outputs_.push(DecompressJob{call.job, request.codec, request.raw_bytes, request.body});
    return;
  }
  auto raw = decompress(request.body.view(), request.codec, request.raw_bytes);
  if (raw) return invoke(served, id, call, Payload::adopt(std::move(raw).value()), now);
  malformed(served, id);
}

void ServiceExports::end_decoding(Served& served) {
  served.decoding = {};
  --served.service->decoding;
}

void ServiceExports::malformed(Served& served, CallId id) {
  Link& link = links_.at(served.link);
  if (link.connection)
    link.fail({CloseCode::kMalformed, "a compressed request does not decompress to its size"});
  erase(served, served.calls.find(id));
}

void ServiceExports::invoke(Served& served, CallId id, Call& call, Payload request,
                            const Now& now) {
  call.state = CallState::kInFlight;
  call.invocation = outputs_.new_invocation();
  call.invoked = now.steady;
  invocations_[call.invocation] = {&served, id};
  served.service->queue.hand_over(call.invocation, now.steady);
  outputs_.push(SendRequest{served.service->client, call.invocation, std::move(request)});
}

void ServiceExports::free_place(Served& served) {
  --served.in_flight;
  if (!served.service->results) --load_of(served).in_flight;
}

void ServiceExports::erase(Served& served, Calls::iterator at) {
  Call& call = at->second;
  PeerLoad& load = load_of(served);
  switch (call.state) {
    case CallState::kWaiting:
      served.waiting.erase(at->first);
      --load.waiting;
      load.request_bytes -= call.request.body.size();
      break;
    case CallState::kInLine:
      std::erase(served.service->line, &served);
      served.in_line = {};
      load.request_bytes -= call.request.body.size();
      free_place(served);
      break;
    case CallState::kDecoding:
      if (served.decoding == at->first) end_decoding(served);
      free_place(served);
      break;
    case CallState::kInFlight:
      if (served.service->client)
        outputs_.push(DropInvocation{served.service->client, call.invocation});
      invocations_.erase(call.invocation);
      free_place(served);
      break;
    case CallState::kEncoding:
    case CallState::kAnswered: load.answer_bytes -= call.answer.body.size(); break;
  }
  if (call.job) jobs_.erase(call.job);
  if (call.timer) timers_.erase(*call.timer);
  --load.calls;
  served.calls.erase(at);
}

}  // namespace connect_bridge
