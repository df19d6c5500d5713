#include "core/services/peer_service.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "core/compress/compress.hpp"
#include "core/link/link_audit.hpp"
#include "core/offers/import_right.hpp"
#include "core/services/peer_services.hpp"

namespace connect_bridge {
namespace {

constexpr char kNoMemoryOf[] = "no memory is left in the share of ";

// The answer to a request for a result begins with the goal's status, behind the header of CDR.
bool is_unknown_goal(ByteView answer) {
  constexpr std::size_t kHeader = 4;
  constexpr std::uint8_t kStatusUnknown = 0;  // action_msgs/msg/GoalStatus
  return answer.size() > kHeader && answer[kHeader] == kStatusUnknown;
}

}  // namespace

PeerService::PeerService(ServiceMirror& service, Link& link, PeerServices& imports)
    : service_(service),
      link_(link),
      imports_(imports),
      load_(imports.loads.try_emplace(link.id, link.memory).first->second) {}

// ---- what is offered

void PeerService::on_offer(const ChannelOffer& offer, Decision decision) {
  offer_ = offer;
  decision_ = std::move(decision);
  unfit_ = false;
  link_.take_offered(offer_.channel, *this);
}

void PeerService::on_link_lost() {
  offer_.channel = requests_ = {};
  attached_ = false;
}

void PeerService::on_withdraw(const Withdraw& why, const Now& now) {
  const auto& [name, type] = service_.key();
  log_withdrawn(imports_.outputs, link_, shown(InterfaceKind::kService, name, type), why);
  note_end({why.reason.empty() ? "the peer withdrew it" : why.reason, why.code});
  PeerServices& imports = imports_;  // outlives this object, and so may the service
  ServiceMirror& service = service_;
  service.remove_feed(link_.id, "the peer withdrew the service", now);
  imports.update(service, now);
}

void PeerService::note_end(const Ending& why) const {
  note_import_end(imports_, link_, InterfaceKind::kService, service_.key(), decision_.rule, why);
}

// ---- attach and detach

void PeerService::attach() {
  requests_ = link_.open_channel(*this);
  link_.sending().add_channel(requests_, queue_of_calls(decision_));
  if (!encoder_ || encoder_->bytes() == 0) start_encoder();
  link_.send(Attach{offer_.channel, requests_});
}

void PeerService::detach() {
  if (!requests_) return;
  link_.withdraw(requests_);
  requests_ = {};
  attached_ = false;
}

Result<Nothing> PeerService::on_attached(const Attached& attached, const Now& now) {
  // An answer to an earlier `attach`, which has ended meanwhile, is ignored.
  if (requests_ != attached.requests) return Nothing{};
  if (attached_) return Error{CloseCode::kIllegal, "attached twice"};
  if (attached.seen.value >= kCallNumbersMax)
    return Error{CloseCode::kIllegal, "more calls seen than can be made"};
  attached_ = true;
  attached_to_ = link_.login.identity().name;
  type_hash_ = attached.type_hash;
  if (keeps_results() && !service_.fits(type_hash_)) {
    service_.close("its type is another one after the break", now);
  } else {
    reconcile(attached, now);
    if (keeps_results()) ask_again(now);
  }
  imports_.update(service_, now);
  return Nothing{};
}

void PeerService::reconcile(const Attached& attached, const Now& now) {
  const std::set<CallId> open(attached.calls.begin(), attached.calls.end());
  std::vector<CallId> forget;
  // Nobody here waits for these calls any longer; without `forget` the server would execute them in
  // vain.
  for (const CallId id : open)
    if (id <= attached.seen && !calls_.contains(id)) forget.push_back(id);
  for (auto it = calls_.begin(); it != calls_.end();) {
    MadeCall& call = (it++)->second;
    if (call.id() > attached.seen) {
      // Without a caller the call is never executed, and its number is skipped (docs/protocol.md
      // section 9.6).
      if (!call.request()) {
        erase(call);
      } else if (call.is_kept() || call.is_delivered()) {
        push(call, now);  // mutant: requests_again
      }
    } else if (!open.contains(call.id())) {
      if (call.has_answer()) continue;
      // The call was refused, forgotten or too large on the lost connection.
      note_losses(1, "the peer gave it up while the connection was lost", now);
      give_up(call);
    } else {
      call.on_delivered();
      if (call.request()) continue;
      forget.push_back(call.id());
      erase(call);
    }
  }
  // A peer service may be newer than the epoch: its numbers begin behind its predecessor's.
  last_ = std::max(last_, attached.seen);
  std::sort(forget.begin(), forget.end());
  say_forget(std::move(forget));
}

// ---- requests

bool PeerService::gives_results() const {
  return service_.gives_results();
}

void PeerService::on_request(RequestId request, Payload payload, const Now& now) {
  if (keeps_results() && !is_offered()) {
    note_refusal("the link with " + link_.label() + " is lost", now);
    return drop_request(request);
  }
  const std::size_t size = payload.size();
  if (service_.gives_results() && size <= kResultRequestMax) results_[request] = {payload};
  if (!make_call(request, std::move(payload), now)) return;
  ++counts_.calls;
  counts_.request_bytes += size;
}

bool PeerService::make_call(RequestId request, Payload payload, const Now& now) {
  const std::size_t size = payload.size();
  if (const std::string why = no_room(size); !why.empty()) {
    note_refusal(why, now);
    drop_request(request);
    return false;
  }
  last_ = {last_.value + 1};
  const CallId id = last_;
  calls_.try_emplace(id, *this, id, request, size, now);
  by_request_[request] = id;
  if (!encoder_) {
    on_encoded(id, Codec::kNone, payload, payload, now);
    return true;
  }
  // The encoder drops nothing: no_room() limits its input.
  (void)encoder_->push({id, now.system, 0, std::move(payload), {}});
  send_encoded(now);
  return true;
}

// ---- results after a break

bool PeerService::keep_results(const Now& now) {
  if (keeps_results()) return true;
  if (results_.empty() || !link_.life.may_return() || !link_.life.keeps()) return false;
  if (attached_to_ != link_.login.identity().name) return false;
  std::vector<RequestId> others;
  for (const auto& [request, id] : by_request_)
    if (!results_.contains(request)) others.push_back(request);
  std::sort(others.begin(), others.end());
  note_losses(others.size(), "their requests are too large to be made again", now);
  for (const RequestId request : others) drop_request(request);
  calls_.clear();
  by_request_.clear();
  if (encoder_) encoder_->clear();
  kept_for_ = attached_to_;
  log_calls(imports_.outputs, link_.account->calls_made.kept,
            "for results of goals wait for the return of " + link_.label(), service_.key(), {}, now,
            results_.size());
  return true;
}

void PeerService::ask_again(const Now& now) {
  kept_for_.reset();
  std::vector<std::pair<RequestId, Payload>> asked;
  for (auto& [request, awaited] : results_) {
    if (by_request_.contains(request)) continue;  // made since the service was offered again
    awaited.again = true;
    asked.emplace_back(request, awaited.request);
  }
  for (auto& [request, payload] : asked) make_call(request, std::move(payload), now);
}

std::string PeerService::no_room(std::size_t bytes) const {
  const ServiceOptions& limits = imports_.options;
  const std::size_t calls_max =
      service_.gives_results()
          ? kResultCallsMax
          : std::size_t{decision_.treatment.calls_max} + limits.calls_waiting_max;
  if (link_.open() && bytes > link_.peer_message_bytes_max())
    return "a request is larger than " + link_.label() + " accepts";
  if (calls_.size() >= calls_max || load_.calls.used() >= kPeerCallsMax)
    return "too many calls without an answer";
  if (load_.request_bytes.used() + bytes > limits.call_bytes_max ||
      (link_.open() && link_.outbox().kept_bytes() > kept_bytes_max(limits.call_bytes_max)))
    return "too many bytes of requests wait for " + link_.label();
  if (bytes > link_.memory.room()) return std::string(kNoMemoryOf) + link_.label();
  if (last_.value >= UINT32_MAX - 1) return "no call numbers are left";
  return {};
}

void PeerService::start_encoder() {
  encoder_.reset();
  Encoder::Options options;
  options.how = decision_.treatment.compression;
  if (options.how.codec == Codec::kNone) return;
  options.queue_bytes_max = UINT64_MAX;  // no_room() limits its input
  encoder_.emplace(options, imports_.jobs, *this);
}

void PeerService::on_job(std::optional<Payload> result, const Now& now) {
  encoder_->finish(std::move(result));
  send_encoded(now);
}

void PeerService::send_encoded(const Now& now) {
  while (const auto ready = encoder_->next())
    on_encoded(ready->sample.subject.call(), ready->codec, ready->sample.raw, ready->body, now);
}

void PeerService::on_encoded(CallId id, Codec codec, const Payload& raw, const Payload& body,
                             const Now& now) {
  const auto call = calls_.find(id);
  if (call == calls_.end()) return;  // given up meanwhile
  call->second.keep(codec, static_cast<std::uint32_t>(raw.size()), body);
  if (attached_) push(call->second, now);
}

// The request is kept until the peer has it, in case another connection must carry it. A request
// from a time without connection is checked against the peer's limit only now.
void PeerService::push(MadeCall& call, const Now& now) {
  if (call.message().raw_bytes <= link_.peer_message_bytes_max())
    return link_.sending().push(requests_, call.message(), now);
  note_refusal("a request is larger than " + link_.label() + " accepts", now);
  give_up(call);
}

void PeerService::on_delivered(CallId id, const Now&) {
  const auto call = calls_.find(id);
  if (call == calls_.end()) return;  // answered already
  call->second.on_delivered();
  if (call->second.request()) return;
  say_forget({id});
  erase(call->second);
}

// ---- answers

Result<Nothing> PeerService::on_message(InMessage message, const Now& now) {
  const auto at = calls_.find(message.subject.call());  // mutant: answer_to_caller
  if (!attached_ || at == calls_.end() || at->second.has_answer()) {
    ++counts_.duplicates;  // sent again, or nobody waits any longer
    return Nothing{};
  }
  MadeCall& call = at->second;
  // Large answers are decompressed by a worker, not on the loop.
  const bool large = message.codec != Codec::kNone && imports_.jobs.is_large(message.raw_bytes);
  std::string why = message.kept ? "" : kNoMemoryOf + link_.label();
  if (why.empty() && !link_.may_inflate(message, now))
    why = "answers decompress to much more than their size";
  if (why.empty() && large && !call.decode(message)) why = kNoMemoryOf + link_.label();
  if (!why.empty()) {
    note_refusal(why, now);
    give_up(call);
  }
  if (!why.empty() || large) return Nothing{};
  if (message.codec == Codec::kNone) {
    respond(call, message.body, now);
    return Nothing{};
  }
  auto raw = decompress(message.body.view(), message.codec, message.raw_bytes);
  if (!raw) {  // the request must not be sent again on the next connection
    give_up(call);
    return raw.error();
  }
  respond(call, Payload::adopt(std::move(raw).value()), now);
  return Nothing{};
}

void PeerService::on_decoded(MadeCall& call, std::optional<Payload> answer, const Now& now) {
  if (answer) return respond(call, *answer, now);
  give_up(call);
  link_.fail({CloseCode::kMalformed, "a compressed answer does not decompress to its size"});
}

void PeerService::respond(MadeCall& call, const Payload& answer, const Now& now) {
  const auto awaited = results_.find(call.request());
  if (awaited != results_.end() && awaited->second.again && is_unknown_goal(answer.view())) {
    note_losses(1, "its server does not know the goal any longer", now);
    return give_up(call);
  }
  ++counts_.answered;
  if (now.steady - call.since() < MadeCall::kLong) long_noted_ = false;
  counts_.response_bytes += answer.size();
  if (awaited != results_.end()) results_.erase(awaited);
  if (call.request())
    imports_.outputs.push(SendResponse{service_.mirror(), call.request(), answer});
  erase(call);
}

Result<Nothing> PeerService::on_refuse(const Refuse& refuse, const Now& now) {
  if (!attached_) return Nothing{};
  for (const CallId id : refuse.calls) {
    const auto call = calls_.find(id);
    if (call == calls_.end() || call->second.has_answer()) continue;
    ++(refuse.code == "timeout" ? counts_.timed_out : counts_.refused);
    const bool sent = refuse.code == "lost" || refuse.code == "timeout";  // perhaps executed
    log_calls(imports_.outputs, link_.account->calls_made.refusals,
              (sent ? "not answered by " : "refused by ") + link_.owner(), service_.key(),
              "it says: " + refuse.reason + " (" + refuse.code + ")", now);
    give_up(call->second);
  }
  return Nothing{};
}

// ---- calls that end without an answer

void PeerService::on_callers_gone(const std::vector<RequestId>& requests) {
  std::vector<CallId> forget;
  for (const RequestId request : requests) {
    const bool awaited = results_.erase(request) > 0;
    const auto id = by_request_.find(request);
    const bool under_way = id != by_request_.end();
    if (!under_way && !awaited) continue;
    ++counts_.forgotten;
    imports_.outputs.push(DropRequest{service_.mirror(), request});
    if (under_way) abandon(calls_.at(id->second), forget);  // mutant: callers_vanish
  }
  say_forget(std::move(forget));
}

void PeerService::on_due(MadeCall& call, const Now& now) {
  if (!call.request()) return;  // its caller is gone already
  if (!call.times_out(now)) return note_long(call, now);
  ++counts_.timed_out;
  log_calls(imports_.outputs, link_.account->calls_made.timeouts, "not answered in time",
            service_.key(), {}, now);
  drop_request(call.request());
  std::vector<CallId> forget;
  abandon(call, forget);
  say_forget(std::move(forget));
}

void PeerService::abandon(MadeCall& call, std::vector<CallId>& forget) {
  by_request_.erase(call.request());
  call.forget_caller();
  if (attached_ && call.is_delivered() && !call.has_answer()) forget.push_back(call.id());
  // A call without a caller is not executed if the request can be taken back. Otherwise the call
  // waits while the request is on its way; on a new connection the exporter lists the calls that it
  // has.
  if (attached_ && call.is_kept() && !link_.sending().take_back(requests_, call.id())) return;
  erase(call);
}

void PeerService::give_up(MadeCall& call) {
  drop_request(call.request());
  erase(call);
}

void PeerService::drop_request(RequestId request) {
  if (!request) return;
  ++imports_.unanswered;
  results_.erase(request);
  imports_.outputs.push(DropRequest{service_.mirror(), request, service_.gives_results()});
}

void PeerService::note_losses(std::uint64_t calls, const std::string& why, const Now& now) {
  counts_.lost += calls;
  log_calls(imports_.outputs, link_.account->calls_made.losses, "get no answer", service_.key(),
            why, now, calls);
}

void PeerService::say_forget(std::vector<CallId> calls) {
  if (!calls.empty()) link_.send(Forget{offer_.channel, std::move(calls)});
}

void PeerService::note_refusal(const std::string& why, const Now& now) {
  ++counts_.refused;
  log_calls(imports_.outputs, link_.account->calls_made.refusals, "refused", service_.key(), why,
            now);
}

// Once for a server that is always slow, and again if one hangs that was not.
void PeerService::note_long(const MadeCall& call, const Now& now) {
  if (long_noted_ || !attached_) return;  // a break has lines of its own
  const auto count = link_.account->calls_made.waits.count(now, 1);
  if (!count) return;
  long_noted_ = true;
  imports_.outputs.log(
      LogLevel::kWarn,
      std::to_string(*count) + " call(s) without an answer for 10 s, last one of " +
          service_.key().first + ": " +
          (call.is_delivered() ? "its server at " + link_.label() + " is slow, or hangs"
                               : "the request has not arrived at " + link_.label()) +
          "; `call_timeout` in the rule limits the wait");
}

void PeerService::erase(MadeCall& call) {
  if (call.request()) by_request_.erase(call.request());
  calls_.erase(call.id());
}

void PeerService::end_calls(const char* why, const Now& now) {
  std::set<RequestId> waiting;
  for (const auto& [request, awaited] : results_) waiting.insert(request);
  for (const auto& [request, id] : by_request_) waiting.insert(request);
  note_losses(waiting.size(), why, now);
  // Other requests end with their mirror.
  if (service_.gives_results()) {
    for (const RequestId request : waiting) drop_request(request);
  } else {
    imports_.unanswered += waiting.size();
  }
  kept_for_.reset();
  calls_.clear();
  by_request_.clear();
  if (encoder_) encoder_->clear();
}

void PeerService::add_status(LinkStatus& status) const {
  ServiceStatus s = counts_;
  s.service = service_.key().first;
  s.type = service_.key().second;
  s.rule = decision_.rule;
  s.attached = attached_ && service_.mirror();
  s.also_here = service_.is_served_here();
  s.pending = static_cast<std::uint32_t>(calls_.size());
  const auto oldest = std::find_if(calls_.begin(), calls_.end(), [](const auto& entry) {
    return static_cast<bool>(entry.second.request());
  });
  if (oldest != calls_.end()) s.oldest = status.at - oldest->second.since();
  status.services.push_back(std::move(s));
}

void PeerService::add_channel(std::vector<ChannelFacts>& channels) const {
  const auto& [name, type] = service_.key();
  channels.push_back({InterfaceKind::kService, false, name, type, decision_.rule});
}

}  // namespace connect_bridge
