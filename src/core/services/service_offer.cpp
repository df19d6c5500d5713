#include "core/services/service_offer.hpp"

#include <algorithm>
#include <utility>

#include "core/link/link_audit.hpp"
#include "core/services/local_services.hpp"

namespace connect_bridge {
namespace {

// After a reconnect the peer has this long to attach again.
constexpr Duration kAttachTime = std::chrono::seconds(30);
constexpr char kNoMemory[] = "no memory is left in this peer's share";
constexpr char kTooLarge[] = "the answer is larger than this peer accepts";

}  // namespace

ServiceOffer::ServiceOffer(LocalService& service, Link& link, LocalServices& exports)
    : service_(service),
      link_(link),
      exports_(exports),
      load_(exports.loads.try_emplace(link.id, link.memory).first->second),
      offer_(exports, link, service.what(), LinkOffer::Terms::kFollowed) {}

// ---- what is offered

std::optional<ChannelOffer> ServiceOffer::offer(const Now& now) {
  if (!offer_.is_due()) return std::nullopt;
  auto offer = offer_.open(*this);
  if (!offer) {
    if (held_) detach("a rule has changed while the link was lost", now);
    return std::nullopt;
  }
  if (held_) {
    admit();
    not_back_ = exports_.timers.set(now.steady + kAttachTime, {&service_, this});
  }
  if (epoch_ == 0) epoch_ = static_cast<std::uint32_t>(1 + exports_.random.below(UINT32_MAX));
  const QueueOptions queue = queue_of_calls(offer_.decision());
  link_.sending().add_channel(offer->channel, queue);
  offer->priority = queue.priority;
  offer->node = link_.names.wire_name(service_.node());
  offer->epoch = epoch_;
  return offer;
}

// Small answers are compressed by the link's queue. Large answers are few, so no gain is measured
// for them. At their usual ratio and a worker's usual speed, compression pays below this rate of
// the path.
Compression ServiceOffer::compression_of(std::size_t bytes) const {
  constexpr double kCompressedRateMax = 20e6;
  Compression how = offer_.decision().treatment.compression;
  if (!how.automatic || !link_.open() || !exports_.jobs.is_large(bytes)) return how;
  const double rate = link_.outbox().assumed_rate();
  if (rate > 0 && rate < kCompressedRateMax) how.codec = Codec::kZstd;
  return how;
}

std::optional<Ending> ServiceOffer::review() {
  const Treatment before = offer_.treatment();
  if (auto why = offer_.review(held_)) return why;
  if (offer_.treatment() == before) return std::nullopt;
  if (held_) admit();
  if (offer_.is_open())
    link_.sending().add_channel(offer_.number(), queue_of_calls(offer_.decision()));
  return std::nullopt;
}

void ServiceOffer::admit() {
  service_.gate().admit(link_.id, {offer_.treatment().calls_max, offer_.treatment().server_queue,
                                   link_.account->number});
}

void ServiceOffer::on_link_lost() {
  not_back_.cancel();
  offer_.lose();
  attached_ = false;
  requests_ = {};
}

void ServiceOffer::end(const Ending& why, const Now& now) {
  end_calls(why.reason, now);
  // Requests may be on their way: they are accepted until the peer announces that no more follow.
  if (requests_) link_.let_go(requests_);
  offer_.close(why);
  requests_ = {};
  held_ = attached_ = false;
}

void ServiceOffer::detach(const std::string& why, const Now& now) {
  end_calls(why, now);
  requests_ = {};
  held_ = attached_ = false;
  service_.release_client();
}

void ServiceOffer::end_calls(const std::string& why, const Now& now) {
  not_back_.cancel();
  std::size_t waiting = 0;
  for (const auto& [id, call] : calls_)
    if (call.state() != ServedCall::State::kAnswered || !link_.open()) ++waiting;
  const bool may_ask_again = service_.gives_results();
  if (!may_ask_again) exports_.unanswered += waiting;
  note_losses(waiting, may_ask_again ? why + "; the peer may ask again" : why, now);
  service_.gate().dismiss(link_.id);
  while (!calls_.empty()) erase(calls_.begin()->second);
  service_.begin_calls(now);  // others get its places
}

void ServiceOffer::on_ready(const Now& now) {
  if (requests_ && !attached_) send_attached(now);
}

void ServiceOffer::send_attached(const Now& now) {
  attached_ = true;
  static_assert(kPeerCallsMax <= kCallIdsMax, "all calls of a peer fit into one message");
  Attached attached{offer_.number(), requests_, seen_, {}, service_.type_hash()};
  for (const auto& [id, call] : calls_) attached.calls.push_back(id);
  link_.send(attached);
  // Answers follow the list: before it the peer takes none (docs/protocol.md section 9.7).
  for (auto it = calls_.begin(); it != calls_.end();) {
    ServedCall& call = (it++)->second;
    if (call.state() == ServedCall::State::kAnswered) push(call, now);  // mutant: answers_again
  }
}

// ---- for the audit log

// Goals are logged under the name of their action.
std::optional<Audit> ServiceOffer::line_of_call(AuditEvent event, const std::string& why) const {
  if (!exports_.outputs.audits()) return std::nullopt;
  const LocalInterface& what = *service_.what();
  AuditChannel channel{Direction::kExport, what.kind, offer_.wire_name(), what.key.second,
                       offer_.decision().rule};
  const auto part = part_of_action(channel.kind, channel.name, channel.type);
  if (part && part->part == ActionPart::kSendGoal) {
    if (event == AuditEvent::kCall) event = AuditEvent::kGoal;
    channel = {Direction::kExport, InterfaceKind::kAction, std::string(part->action),
               std::string(part->action_type), offer_.decision().rule};
  }
  Audit line = audit_of(link_, event);
  line.channel = std::move(channel);
  line.reason = why;
  return line;
}

// ---- messages of the peer

void ServiceOffer::on_decline(const Decline& decline, const Now& now) {
  offer_.on_decline(decline, now);
}

Result<Nothing> ServiceOffer::on_attach(const Attach& attach, const Now& now) {
  if (requests_)
    return Error{CloseCode::kIllegal, "attached to a service twice"};  // mutant: attached_twice
  // Making a client takes the middleware about a millisecond, in which the loop does nothing else.
  if (!service_.client() && !link_.account->attaches.take(now.steady))
    return Error{CloseCode::kTooLarge, "services are attached and ended too often"};
  link_.expect(attach.requests, *this);
  offer_.on_taken();
  not_back_.cancel();
  requests_ = attach.requests;
  held_ = true;
  service_.use_client();
  admit();
  if (service_.is_ready()) send_attached(now);
  service_.begin_calls(now);  // calls that wait since the last connection
  return Nothing{};
}

void ServiceOffer::on_withdraw(const Withdraw&, const Now& now) {
  detach("the peer has ended its mirror", now);
  link_.sending().clear_channel(offer_.number());
}

Result<Nothing> ServiceOffer::on_forget(const Forget& forget, const Now& now) {
  for (const CallId id : forget.calls) {
    const auto call = calls_.find(id);
    if (call == calls_.end()) continue;  // its answer is on its way
    ++counts_.forgotten;
    erase(call->second);
  }
  service_.begin_calls(now);
  return Nothing{};
}

void ServiceOffer::on_delivered(CallId id, const Now&) {
  const auto call = calls_.find(id);
  if (call != calls_.end() && call->second.state() == ServedCall::State::kAnswered)
    erase(call->second);
}

Result<Nothing> ServiceOffer::on_message(InMessage message, const Now& now) {
  if (!attached_)
    return Error{CloseCode::kIllegal,
                 "a request before the service attached"};  // mutant: requests_attached
  const CallId id = message.subject.call();
  // The request was sent again after a reconnect, but had arrived before.
  if (id <= seen_) {  // mutant: requests_seen
    ++counts_.duplicates;
    return Nothing{};
  }
  const bool used_up = id.value >= kCallNumbersMax;
  if (used_up && !link_.account->attaches.take(now.steady))
    return Error{CloseCode::kTooLarge, "call numbers are used up too often"};
  // Every request counts as seen, whatever its end: a repetition is not executed (docs/protocol.md
  // section 9.5).
  seen_ = id;
  take(std::move(message), now);
  // The peer has used up its call numbers; the calls of others continue.
  if (used_up) service_.renew(link_.id, now);
  return Nothing{};
}

// ---- its calls

void ServiceOffer::take(InMessage message, const Now& now) {
  const CallId id = message.subject.call();
  ++counts_.calls;
  counts_.request_bytes += message.raw_bytes;
  std::string why = message.kept ? no_room_for_request(message.body.size()) : kNoMemory;
  if (why.empty() && !link_.may_inflate(message, now))
    why = "too many requests decompress to much more than their size";
  if (!why.empty()) {
    if (auto line = line_of_call(AuditEvent::kCallRefused, why))
      exports_.outputs.push(*std::move(line));
    note_refusal("refused", why, now);
    return refuse(id, "limit", why);
  }
  calls_.try_emplace(id, *this, id, std::move(message), now);
  service_.begin_calls(now);
  if (const auto call = calls_.find(id); call != calls_.end()) call->second.keep_copy();
}

std::string ServiceOffer::no_room_for_request(std::size_t bytes) const {
  const ServiceOptions& limits = exports_.options;
  if (load_.calls.used() >= kPeerCallsMax) return "too many calls without an answer";
  if (load_.request_bytes.used() + bytes > limits.call_bytes_max)
    return "too many bytes of requests wait";
  if (bytes > link_.memory.room()) return kNoMemory;
  if (service_.gives_results() && calls_.size() >= kResultCallsMax)
    return "too many results are waited for";
  if (service_.gate().would_wait(link_.id) && load_.waiting.used() >= limits.calls_waiting_max)
    return "too many calls wait for the server";
  return {};
}

std::string ServiceOffer::no_room_for_answer(std::size_t bytes) const {
  const std::uint64_t bytes_max = exports_.options.call_bytes_max;
  if (link_.open() && bytes > link_.peer_message_bytes_max()) return kTooLarge;
  if (load_.answer_bytes.used() > bytes_max ||
      (link_.open() && link_.outbox().kept_bytes() > kept_bytes_max(bytes_max)))
    return "too many bytes of answers wait for this peer";
  // The answer itself is counted in the link's memory already.
  return link_.memory.room() == 0 ? kNoMemory : "";
}

void ServiceOffer::begin(CallId id, const Now& now) {
  const auto call = calls_.find(id);
  if (call != calls_.end()) call->second.begin(now);
}

void ServiceOffer::on_answer(ServedCall& call, const Now& now) {
  counts_.response_bytes += call.answer().raw_bytes;
  ++counts_.answered;
  if (attached_) push(call, now);
}

// The answer is kept until the peer has it, in case another connection must carry it. An answer
// from a time without connection is checked against the peer's limit only now.
void ServiceOffer::push(ServedCall& call, const Now& now) {
  if (!link_.open()) return;
  if (call.answer().raw_bytes > link_.peer_message_bytes_max())
    return withhold(call, kTooLarge, now);
  link_.sending().push(offer_.number(), call.answer(), now);
}

void ServiceOffer::withhold(ServedCall& call, const std::string& why, const Now& now) {
  note_refusal("refused", why, now);
  refuse(call.id(), "limit", why);
  erase(call);
}

void ServiceOffer::on_failed(ServedCall& call, const std::string& reason, const Now& now) {
  note_refusal("failed", reason, now);
  refuse(call.id(), "failed", reason);
  erase(call);
}

void ServiceOffer::on_malformed(ServedCall& call) {
  link_.fail({CloseCode::kMalformed, "a compressed request does not decompress to its size"});
  erase(call);
}

void ServiceOffer::on_timeout(ServedCall& call, const Now& now) {
  ++counts_.timed_out;
  ++exports_.unanswered;
  log_calls(exports_.outputs, link_.account->calls_served.timeouts,
            "of " + link_.owner() + " not answered in time", service_.key(), {}, now);
  refuse(call.id(), "timeout", "the server did not answer in time");
  erase(call);
}

void ServiceOffer::end_lost(TimePoint before, const Now& now) {
  for (auto it = calls_.begin(); it != calls_.end();) {
    ServedCall& call = (it++)->second;
    if (!call.handed_over_before(before)) continue;
    ++exports_.unanswered;
    note_losses(1, "the server that got the request is gone", now);
    refuse(call.id(), "lost", "the server that got the request is gone");
    erase(call);
  }
  service_.begin_calls(now);
}

void ServiceOffer::note_refusal(const std::string& what, const std::string& why, const Now& now) {
  ++counts_.refused;
  ++exports_.unanswered;
  log_calls(exports_.outputs, link_.account->calls_served.refusals,
            "of " + link_.owner() + " " + what, service_.key(), why, now);
}

void ServiceOffer::note_losses(std::uint64_t calls, const std::string& why, const Now& now) {
  counts_.lost += calls;
  log_calls(exports_.outputs, link_.account->calls_served.losses,
            "of " + link_.owner() + " get no answer", service_.key(), why, now, calls);
}

// A refusal may be lost with its connection. The peer then learns of it when it attaches again: the
// call is missing in `attached`.
void ServiceOffer::refuse(CallId call, const std::string& code, const std::string& reason) {
  if (attached_)
    link_.send(Refuse{offer_.number(), {call}, code, reason.substr(0, kReasonBytesMax)});
}

void ServiceOffer::erase(ServedCall& call) {
  call.end();
  calls_.erase(call.id());
}

void ServiceOffer::add_status(LinkStatus& status) const {
  if (!offer_.is_open()) return;
  ServiceStatus s = counts_;
  s.service = service_.key().first;
  s.type = service_.key().second;
  s.exported = true;
  s.rule = offer_.decision().rule;
  s.attached = attached_;
  s.several_here = service_.has_several_servers();
  if (!requests_) {
    s.declined = offer_.declined().reason;
    s.declined_code = offer_.declined().code;
  }
  s.pending = static_cast<std::uint32_t>(calls_.size());
  const auto oldest = std::find_if(calls_.begin(), calls_.end(), [](const auto& entry) {
    return entry.second.state() < ServedCall::State::kAnswered;
  });
  if (oldest != calls_.end()) s.oldest = status.at - oldest->second.since();
  s.waiting = static_cast<std::uint32_t>(service_.gate().waiting(link_.id));
  status.services.push_back(std::move(s));
}

void ServiceOffer::add_channel(std::vector<ChannelFacts>& channels) const {
  if (!offer_.is_open()) return;
  const auto& [name, type] = service_.key();
  ChannelFacts facts{InterfaceKind::kService, true, name, type, offer_.decision().rule};
  if (!requests_) facts.declined = offer_.declined();
  channels.push_back(std::move(facts));
}

}  // namespace connect_bridge
