// The way of a call: taken from a link, given a place at the real server, answered or refused.
#include <algorithm>

#include "core/compress/compress.hpp"
#include "core/link/options.hpp"
#include "core/services/service_exports.hpp"

namespace connect_bridge {
namespace {

constexpr char kTooLarge[] = "the answer is larger than this peer takes";

}  // namespace

std::optional<Result<Nothing>> ServiceExports::on_message(Link& link, InMessage& message,
                                                          const Now& now) {
  const auto it = by_requests_.find({link.id, message.channel});
  if (it == by_requests_.end()) return std::nullopt;
  if (!it->second) return Nothing{};  // it crossed our withdraw
  return take(link, *it->second, std::move(message), now);
}

Result<Nothing> ServiceExports::take(Link& link, Served& served, InMessage message,
                                     const Now& now) {
  if (!served.attached) return Error{CloseCode::kIllegal, "a request before the service attached"};
  const CallId id = message.subject.call();
  if (id <= served.seen) {  // sent again after a reconnect, and it had arrived
    ++served.counts.duplicates;
    return Nothing{};
  }
  served.seen = id;
  ++served.counts.calls;
  served.counts.request_bytes += message.raw_bytes;
  PeerLoad& load = load_of(served);
  if (const std::string why = no_room(served, load, message); !why.empty()) {
    ++served.counts.refused;
    if (const auto count = load.refusals.count(now))
      outputs_.log(LogLevel::kWarn, std::to_string(*count) + " call(s) of " + link.label() +
                                        " refused, lately of " + served.service->key.first + ": " +
                                        why);
    refuse(served, id, "limit", why);
  } else {
    Call& call = served.calls[id];
    call.request = std::move(message);
    load.request_bytes += call.request.body.size();
    ++load.waiting;
    ++load.calls;
    served.waiting.insert(id);
    if (!served.service->results && served.decision.treatment.call_timeout != kForever) {
      call.timer = TimerKey{now.steady + served.decision.treatment.call_timeout, ++last_timer_};
      timers_[*call.timer] = {&served, id};
    }
    resume(served, now);
    const auto waits = served.calls.find(id);
    // A message of one part is a slice: it must not keep its whole packet while it waits.
    if (waits != served.calls.end() && waits->second.state <= CallState::kInLine &&
        waits->second.request.body.size() <= kPacketBytesMax)
      waits->second.request.body = Payload::copy_of(waits->second.request.body.view());
  }
  if (id.value >= kCallNumbersMax) renew(served, now);
  return Nothing{};
}

std::string ServiceExports::no_room(const Served& served, const PeerLoad& load,
                                    const InMessage& message) const {
  if (load.calls >= kPeerCallsMax) return "too many calls without an answer";
  if (load.request_bytes + message.body.size() > options_.call_bytes_max)
    return "too many bytes of requests wait";
  if (served.service->results && served.calls.size() >= kResultCallsMax)
    return "too many results are waited for";
  const bool waits = !has_place(served) || !served.waiting.empty() ||
                     (!served.service->results && load.in_flight >= options_.calls_max);
  if (waits && load.waiting >= options_.calls_waiting_max)
    return "too many calls wait for the server";
  return {};
}

// A refusal that is lost with its connection is found out when the peer attaches again: the call is
// missing from `attached` then.
void ServiceExports::refuse(Served& served, CallId call, const std::string& code,
                            const std::string& reason) {
  if (served.attached)
    links_.at(served.link)
        .send(Refuse{served.channel, {call}, code, reason.substr(0, kReasonBytesMax)});
}

Result<Nothing> ServiceExports::on_forget(Link& link, const Forget& forget, const Now& now) {
  const auto it = by_channel_.find({link.id, forget.channel});
  if (it == by_channel_.end()) {
    if (forget.channel.value > link.last_channel)
      return Error{CloseCode::kUnknownChannel, "calls of a service that was never offered"};
    return Nothing{};  // it crossed our withdraw
  }
  Served& served = *it->second;
  for (const CallId id : forget.calls) {
    const auto call = served.calls.find(id);
    if (call == served.calls.end()) continue;  // its answer is on its way
    ++served.counts.forgotten;
    erase(served, call);
  }
  resume(served, now);
  return Nothing{};
}

void ServiceExports::on_ready(const ServiceReady& ready, const Now& now) {
  const auto it = by_client_.find(ready.client);
  if (it == by_client_.end()) return;
  Service& service = *it->second;
  if (service.ready == ready.ready) return;
  if (!ready.ready) return renew(service, now);
  service.ready = true;
  service.type_hash = ready.type_hash;
  for (auto& [id, served] : service.links)
    if (served.requests && !served.attached) send_attached(served, links_.at(id), now);
}

void ServiceExports::on_response(ResponseTaken& response, const Now& now) {
  const auto client = by_client_.find(response.client);
  if (client == by_client_.end()) return;
  client->second->queue.answered(response.invocation, now.steady);
  const auto it = invocations_.find(response.invocation);
  if (it == invocations_.end()) return let_in(*client->second, now);  // nobody waits for it
  const auto [served, id] = it->second;
  invocations_.erase(it);
  Call& call = served->calls.at(id);
  call.state = CallState::kEncoding;
  free_place(*served);
  encode(*served, id, call, std::move(response.payload), now);
  resume(*served, now);
}

// There is an answer, but it cannot be given.
void ServiceExports::withhold(Served& served, CallId id, const std::string& why, const Now& now) {
  ++served.counts.refused;
  if (const auto count = load_of(served).refusals.count(now))
    outputs_.log(LogLevel::kWarn, std::to_string(*count) + " call(s) of " +
                                      links_.at(served.link).label() + " refused, lately of " +
                                      served.service->key.first + ": " + why);
  refuse(served, id, "limit", why);
  erase(served, served.calls.find(id));
}

void ServiceExports::encode(Served& served, CallId id, Call& call, Payload raw, const Now& now) {
  PeerLoad& load = load_of(served);
  Link& link = links_.at(served.link);
  const std::size_t size = raw.size();
  call.answer.body = std::move(raw);
  load.answer_bytes += size;
  if (link.connection && size > link.connection->peer().message_bytes_max)
    return withhold(served, id, kTooLarge, now);
  if (load.answer_bytes > options_.call_bytes_max ||
      (link.connection &&
       link.connection->outbox().kept_bytes() > kept_bytes_max(options_.call_bytes_max)))
    return withhold(served, id, "too many bytes of answers wait for this peer", now);
  const Compression how = served.decision.treatment.compression;
  if (how.codec == Codec::kNone) return answer(served, id, call, Codec::kNone, {}, now);
  if (size >= options_.compress_job_bytes) {
    call.job = outputs_.new_job();
    jobs_[call.job] = {&served, id};
    call.answer.codec = how.codec;  // if it shrinks
    outputs_.push(CompressJob{call.job, how, call.answer.body});
    return;
  }
  auto body = compress(call.answer.body.view(), how);
  if (!body) return answer(served, id, call, Codec::kNone, {}, now);
  answer(served, id, call, how.codec, Payload::adopt(std::move(*body)), now);
}

// Without a codec the body is what the call has already.
void ServiceExports::answer(Served& served, CallId id, Call& call, Codec codec, Payload body,
                            const Now& now) {
  OutMessage& message = call.answer;
  served.counts.response_bytes += message.body.size();
  ++served.counts.answered;
  call.state = CallState::kAnswered;
  if (call.timer) timers_.erase(*std::exchange(call.timer, {}));
  message.subject = id;
  message.stamp = now.system;
  message.codec = codec;
  message.raw_bytes = static_cast<std::uint32_t>(message.body.size());
  message.tracked = true;
  if (codec != Codec::kNone) {
    PeerLoad& load = load_of(served);
    load.answer_bytes -= message.body.size();
    load.answer_bytes += body.size();
    message.body = std::move(body);
  }
  if (served.attached) push(served, id, call, now);
}

// Until the peer has it, the answer is kept for another connection. What was answered while there
// was none is compared with the peer's limit only now.
void ServiceExports::push(Served& served, CallId id, const Call& call, const Now& now) {
  Link& link = links_.at(served.link);
  if (!link.open()) return;
  if (call.answer.raw_bytes > link.connection->peer().message_bytes_max)
    return withhold(served, id, kTooLarge, now);
  link.connection->outbox().push(served.channel, call.answer, now);
}

void ServiceExports::push_answers(Served& served, const Now& now) {
  for (auto it = served.calls.begin(); it != served.calls.end();) {
    const auto& [id, call] = *it++;
    if (call.state == CallState::kAnswered) push(served, id, call, now);
  }
}

void ServiceExports::on_delivered(LinkId link, ChannelId channel, CallId id) {
  const auto it = by_channel_.find({link, channel});
  if (it == by_channel_.end()) return;
  const auto call = it->second->calls.find(id);
  if (call != it->second->calls.end() && call->second.state == CallState::kAnswered)
    erase(*it->second, call);
}

void ServiceExports::on_invocation_failed(const InvocationFailed& failed, const Now& now) {
  const auto it = invocations_.find(failed.invocation);
  if (it == invocations_.end()) return;
  const auto [served, id] = it->second;
  invocations_.erase(it);
  const auto call = served->calls.find(id);
  call->second.state = CallState::kDecoding;  // no longer the gateway's
  served->service->queue.failed(failed.invocation);
  ++served->counts.refused;
  if (const auto count = load_of(*served).refusals.count(now))
    outputs_.log(LogLevel::kWarn, std::to_string(*count) + " call(s) of " +
                                      links_.at(served->link).label() + " failed, lately of " +
                                      served->service->key.first + ": " + failed.reason);
  refuse(*served, id, "failed", failed.reason);
  erase(*served, call);
  resume(*served, now);
}

bool ServiceExports::on_job(const JobDone& done, const Now& now) {
  const auto it = jobs_.find(done.job);
  if (it == jobs_.end()) return false;
  const auto [served, id] = it->second;
  jobs_.erase(it);
  Call& call = served->calls.at(id);
  call.job = {};
  if (call.state == CallState::kEncoding) {
    const Codec codec = done.result ? call.answer.codec : Codec::kNone;
    answer(*served, id, call, codec, done.result.value_or(Payload{}), now);
    return true;
  }
  end_decoding(*served);
  if (done.result) {
    invoke(*served, id, call, *done.result, now);
  } else {
    malformed(*served, id);
  }
  resume(*served, now);
  return true;
}

void ServiceExports::on_time(const Now& now) {
  std::vector<Served*> freed;  // resumed at last: no call starts that ends now, too
  while (!timers_.empty() && timers_.begin()->first.first <= now.steady) {
    const auto [served, id] = timers_.begin()->second;
    if (!id) {
      let_go(*served, now);
      continue;
    }
    ++served->counts.timed_out;
    if (const auto count = load_of(*served).timeouts.count(now))
      outputs_.log(LogLevel::kWarn,
                   std::to_string(*count) + " call(s) of " + links_.at(served->link).label() +
                       " not answered in time, lately of " + served->service->key.first);
    refuse(*served, id, "timeout", "the server did not answer in time");
    erase(*served, served->calls.find(id));
    if (freed.empty() || freed.back() != served) freed.push_back(served);
  }
  for (Served* served : freed) resume(*served, now);
  while (!line_timers_.empty() && line_timers_.begin()->first.first <= now.steady) {
    Service& service = *line_timers_.begin()->second;
    line_timers_.erase(*std::exchange(service.line_timer, {}));
    let_in(service, now);
  }
}

std::optional<TimePoint> ServiceExports::deadline() const {
  std::optional<TimePoint> first;
  if (!timers_.empty()) first = timers_.begin()->first.first;
  if (line_timers_.empty()) return first;
  const TimePoint line = line_timers_.begin()->first.first;
  return first ? std::min(*first, line) : line;
}

}  // namespace connect_bridge
