// The way of a call: taken at a mirror, sent to the link that feeds it, its answer given back.
#include <algorithm>
#include <unordered_set>

#include "core/compress/compress.hpp"
#include "core/link/options.hpp"
#include "core/policy/interface.hpp"
#include "core/services/service_exports.hpp"
#include "core/services/service_imports.hpp"

namespace connect_bridge {
namespace {

// The exporter gives a call up first, so that its refusal says why.
constexpr Duration kTimeoutMargin = std::chrono::seconds(1);
// Of compressed answers that wait for the worker; what comes beyond is decompressed at once.
constexpr std::uint64_t kDecodingBytesMax = 64 << 20;

}  // namespace

std::optional<std::string> ServiceImports::action_of(ServiceMirrorId mirror) const {
  const auto it = by_mirror_.find(mirror);
  if (it == by_mirror_.end()) return std::nullopt;
  const auto& [name, type] = it->second->key;
  const auto part = part_of_action(InterfaceKind::kService, name, type);
  if (!part || part->part != ActionPart::kSendGoal) return std::nullopt;
  return std::string(part->action);
}

void ServiceImports::on_request(RequestTaken& request, const Now& now) {
  const auto it = by_mirror_.find(request.mirror);
  if (it == by_mirror_.end()) return;  // the mirror has just been destroyed
  Import& import = *it->second;
  Feed& feed = *feeding(import);
  const std::size_t size = request.payload.size();
  if (const std::string why = no_room(feed, size); !why.empty()) {
    note_refusal(feed, why, now);
    outputs_.push(DropRequest{request.mirror, request.request});
    return;
  }
  feed.last = {feed.last.value + 1};
  const CallId id = feed.last;
  Call& call = feed.calls[id];
  call.request = request.request;
  call.body.stamp = now.system;
  feed.by_request[call.request] = id;
  ++load_of(feed).calls;
  ++feed.counts.calls;
  feed.counts.request_bytes += size;
  keep(feed, call, size);
  const Duration timeout = feed.decision.treatment.call_timeout;
  if (!import.results && timeout != kForever) {
    call.timer = TimerKey{now.steady + timeout + kTimeoutMargin, ++last_timer_};
    timers_[*call.timer] = {&feed, id};
  }
  if (!feed.encoder) return encoded(feed, id, Codec::kNone, request.payload, request.payload, now);
  // Nothing gives way: no_room() bounds what comes here.
  (void)feed.encoder->push({id, now.system, std::move(request.payload), {}});
  send_encoded(feed, now);
}

void ServiceImports::note_refusal(Feed& feed, const std::string& why, const Now& now) {
  ++feed.counts.refused;
  if (const auto count = load_of(feed).refusals.count(now))
    outputs_.log(LogLevel::kWarn, std::to_string(*count) + " call(s) refused, lately of " +
                                      feed.import->key.first + ": " + why);
}

std::string ServiceImports::no_room(const Feed& feed, std::size_t bytes) {
  const PeerLoad& load = load_of(feed);
  const Link& link = links_.at(feed.link);
  const std::size_t calls_max =
      feed.import->results
          ? kResultCallsMax
          : std::size_t{feed.decision.treatment.calls_max} + options_.calls_waiting_max;
  if (link.connection && bytes > link.connection->peer().message_bytes_max)
    return "a request is larger than " + link.label() + " takes";
  if (feed.calls.size() >= calls_max || load.calls >= kPeerCallsMax)
    return "too many calls without an answer";
  if (load.request_bytes + bytes > options_.call_bytes_max ||
      (link.connection &&
       link.connection->outbox().kept_bytes() > kept_bytes_max(options_.call_bytes_max)))
    return "too many bytes of requests wait for " + link.label();
  if (feed.last.value >= UINT32_MAX - 1) return "no call numbers are left";
  return {};
}

void ServiceImports::keep(Feed& feed, Call& call, std::uint64_t bytes) {
  load_of(feed).request_bytes += bytes - call.kept_bytes;
  call.kept_bytes = bytes;
}

void ServiceImports::encoded(Feed& feed, CallId id, Codec codec, const Payload& raw,
                             const Payload& body, const Now& now) {
  const auto it = feed.calls.find(id);
  if (it == feed.calls.end()) return;  // given up meanwhile
  Call& call = it->second;
  call.encoded = true;
  call.body.subject = id;
  call.body.codec = codec;
  call.body.raw_bytes = static_cast<std::uint32_t>(raw.size());
  call.body.body = body;
  call.body.tracked = true;
  keep(feed, call, body.size());
  if (feed.attached) push(feed, it, now);
}

// Until the peer has it, the request is kept for another connection. What was taken while there was
// none is compared with the peer's limit only now.
void ServiceImports::push(Feed& feed, Calls::iterator at, const Now& now) {
  Link& link = links_.at(feed.link);
  const Call& call = at->second;
  if (call.body.raw_bytes <= link.connection->peer().message_bytes_max) {
    link.connection->outbox().push(feed.requests, call.body, now);
    return;
  }
  note_refusal(feed, "a request is larger than " + link.label() + " takes", now);
  if (call.request) outputs_.push(DropRequest{feed.import->mirror, call.request});
  erase(feed, at);
}

void ServiceImports::reconcile(Feed& feed, const Attached& attached, const Now& now) {
  const std::unordered_set<CallId> open(attached.calls.begin(), attached.calls.end());
  std::vector<CallId> forget;
  for (const CallId id : open)
    if (id <= attached.seen && !feed.calls.contains(id)) forget.push_back(id);
  for (auto it = feed.calls.begin(); it != feed.calls.end();) {
    const auto at = it++;
    Call& call = at->second;
    if (at->first > attached.seen) {
      if (!call.request) {
        erase(feed, at);
      } else if (call.encoded) {
        push(feed, at, now);
      }
      continue;
    }
    if (!open.contains(at->first)) {
      if (call.job) continue;  // it has been answered
      // Refused, forgotten or too large on the lost connection.
      if (call.request) outputs_.push(DropRequest{feed.import->mirror, call.request});
      ++feed.counts.lost;
      erase(feed, at);
      continue;
    }
    call.delivered = true;
    call.body.body = {};
    keep(feed, call, 0);
    if (call.request) continue;
    forget.push_back(at->first);
    erase(feed, at);
  }
  feed.last = std::max(feed.last, attached.seen);
  std::sort(forget.begin(), forget.end());
  if (!forget.empty()) links_.at(feed.link).send(Forget{feed.channel, std::move(forget)});
}

void ServiceImports::on_delivered(Link& link, ChannelId channel, CallId id) {
  const auto it = by_requests_.find({link.id, channel});
  if (it == by_requests_.end()) return;
  Feed& feed = *it->second;
  const auto call = feed.calls.find(id);
  if (call == feed.calls.end()) return;  // answered already
  call->second.delivered = true;
  call->second.body.body = {};
  keep(feed, call->second, 0);
  if (call->second.request) return;
  link.send(Forget{feed.channel, {id}});
  erase(feed, call);
}

std::optional<Result<Nothing>> ServiceImports::on_message(Link& link, InMessage& message) {
  const auto it = channels_.find({link.id, message.channel});
  if (it == channels_.end()) return std::nullopt;
  Feed* feed = it->second;
  if (!feed) return Nothing{};  // declined meanwhile
  const auto at = feed->calls.find(message.subject.call());
  if (!feed->attached || at == feed->calls.end() || at->second.job) {
    ++feed->counts.duplicates;  // sent again, or nobody waits any longer
    return Nothing{};
  }
  Call& call = at->second;
  if (message.codec == Codec::kNone) {
    respond(*feed, at, message.body);
    return Nothing{};
  }
  PeerLoad& load = load_of(*feed);
  if (message.raw_bytes >= options_.compress_job_bytes &&
      load.decoding_bytes + message.body.size() <= kDecodingBytesMax) {
    call.job = outputs_.new_job();
    jobs_[call.job] = {feed, at->first};
    call.decoding_bytes = message.body.size();
    load.decoding_bytes += call.decoding_bytes;
    outputs_.push(DecompressJob{call.job, message.codec, message.raw_bytes, message.body});
    return Nothing{};
  }
  auto raw = decompress(message.body.view(), message.codec, message.raw_bytes);
  if (!raw) {  // not to be sent again on the next connection
    if (call.request) outputs_.push(DropRequest{feed->import->mirror, call.request});
    erase(*feed, at);
    return raw.error();
  }
  respond(*feed, at, Payload::adopt(std::move(raw).value()));
  return Nothing{};
}

void ServiceImports::respond(Feed& feed, Calls::iterator at, const Payload& answer) {
  const Call& call = at->second;
  ++feed.counts.answered;
  feed.counts.response_bytes += answer.size();
  if (call.request) outputs_.push(SendResponse{feed.import->mirror, call.request, answer});
  erase(feed, at);
}

Result<Nothing> ServiceImports::on_refuse(Link& link, const Refuse& refuse, const Now& now) {
  const auto it = channels_.find({link.id, refuse.channel});
  if (it == channels_.end())
    return Error{CloseCode::kUnknownChannel, "calls of a service that does not exist are refused"};
  Feed* feed = it->second;
  if (!feed || !feed->attached) return Nothing{};
  for (const CallId id : refuse.calls) {
    const auto call = feed->calls.find(id);
    if (call == feed->calls.end() || call->second.job) continue;
    const bool timeout = refuse.code == "timeout";
    ++(timeout ? feed->counts.timed_out : feed->counts.refused);
    if (const auto count = load_of(*feed).refusals.count(now))
      outputs_.log(LogLevel::kWarn, std::to_string(*count) + " call(s) refused by " + link.label() +
                                        ", lately of " + feed->import->key.first + ": " +
                                        refuse.reason + " (" + refuse.code + ")");
    if (call->second.request)
      outputs_.push(DropRequest{feed->import->mirror, call->second.request});
    erase(*feed, call);
  }
  return Nothing{};
}

void ServiceImports::on_callers_gone(const CallersGone& gone) {
  const auto it = by_mirror_.find(gone.mirror);
  if (it == by_mirror_.end()) return;
  Feed& feed = *feeding(*it->second);
  std::vector<CallId> forget;
  for (const RequestId request : gone.requests) {
    const auto id = feed.by_request.find(request);
    if (id == feed.by_request.end()) continue;
    ++feed.counts.forgotten;
    outputs_.push(DropRequest{gone.mirror, request});
    abandon(feed, feed.calls.find(id->second), forget);
  }
  if (!forget.empty()) links_.at(feed.link).send(Forget{feed.channel, std::move(forget)});
}

void ServiceImports::abandon(Feed& feed, Calls::iterator at, std::vector<CallId>& forget) {
  Call& call = at->second;
  feed.by_request.erase(call.request);
  call.request = {};
  if (feed.attached && call.delivered && !call.job) forget.push_back(at->first);
  // Control messages overtake requests: a request that is still on its way is waited for. On a new
  // connection the exporter says which calls it has.
  if (feed.attached && call.encoded && !call.delivered) return;
  erase(feed, at);
}

void ServiceImports::erase(Feed& feed, Calls::iterator at) {
  Call& call = at->second;
  keep(feed, call, 0);
  PeerLoad& load = load_of(feed);
  load.decoding_bytes -= call.decoding_bytes;
  --load.calls;
  if (call.job) jobs_.erase(call.job);
  if (call.timer) timers_.erase(*call.timer);
  if (call.request) feed.by_request.erase(call.request);
  feed.calls.erase(at);
}

void ServiceImports::end_calls(Feed& feed) {
  feed.counts.lost += feed.calls.size();
  while (!feed.calls.empty()) erase(feed, feed.calls.begin());
  if (feed.encoder) feed.encoder->clear();
}

bool ServiceImports::on_job(const JobDone& done) {
  const auto it = jobs_.find(done.job);
  if (it == jobs_.end()) return false;
  const auto [found, id] = it->second;
  Feed& feed = *found;
  jobs_.erase(it);
  const auto call = feed.calls.find(id);
  call->second.job = {};
  if (done.result) {
    respond(feed, call, *done.result);
    return true;
  }
  if (call->second.request) outputs_.push(DropRequest{feed.import->mirror, call->second.request});
  erase(feed, call);
  Link& link = links_.at(feed.link);
  if (link.connection)
    link.fail({CloseCode::kMalformed, "a compressed answer does not decompress to its size"});
  return true;
}

void ServiceImports::on_time(const Now& now) {
  while (!timers_.empty() && timers_.begin()->first.first <= now.steady) {
    const auto [feed, id] = timers_.begin()->second;
    const auto call = feed->calls.find(id);
    timers_.erase(timers_.begin());
    call->second.timer.reset();
    if (!call->second.request) continue;  // its caller went away before
    ++feed->counts.timed_out;
    if (const auto count = load_of(*feed).timeouts.count(now))
      outputs_.log(LogLevel::kWarn, std::to_string(*count) +
                                        " call(s) not answered in time, lately of " +
                                        feed->import->key.first);
    outputs_.push(DropRequest{feed->import->mirror, call->second.request});
    std::vector<CallId> forget;
    abandon(*feed, call, forget);
    if (!forget.empty()) links_.at(feed->link).send(Forget{feed->channel, std::move(forget)});
  }
  if (!settles_at_ || *settles_at_ > now.steady) return;
  settles_at_.reset();
  for (auto it = imports_.begin(); it != imports_.end();) update((it++)->second, now);
}

std::optional<TimePoint> ServiceImports::deadline() const {
  std::optional<TimePoint> first = settles_at_;
  if (timers_.empty()) return first;
  const TimePoint timer = timers_.begin()->first.first;
  return first ? std::min(*first, timer) : timer;
}

}  // namespace connect_bridge
