#include "core/services/served_call.hpp"

#include <utility>

#include "core/compress/compress.hpp"
#include "core/services/local_services.hpp"
#include "core/services/service_offer.hpp"

namespace connect_bridge {

ServedCall::ServedCall(ServiceOffer& service_offer, CallId id, InMessage request, const Now& now)
    : service_offer_(service_offer),
      exports_(service_offer.exports()),
      id_(id),
      since_(now.steady),
      call_(service_offer.load().calls.hold(1)),
      waiting_(service_offer.load().waiting.hold(1)),
      request_bytes_(service_offer.load().request_bytes.hold(request.body.size())),
      request_(std::move(request)) {
  // The time counts from the arrival of the request, so it includes the wait at the gate
  // (docs/protocol.md section 9.5, rule 8). Results have no limit: they come when the goal ends.
  const Duration timeout = service_offer.treatment().call_timeout;
  if (!service_offer.service().gives_results() && timeout != kForever)
    timer_ =
        exports_.timers.set(now.steady + timeout, {&service_offer.service(), &service_offer, this});
  service_offer.service().gate().add(service_offer.link(), id);
}

void ServedCall::leave() {
  switch (state_) {
    case State::kWaiting:
      request_ = {};
      request_bytes_.release();
      waiting_.release();
      break;
    // The gateway keeps an invocation until it is answered, fails or is dropped.
    case State::kHandedOver: service_offer_.service().drop(invocation_); break;
    case State::kDecoding:
    case State::kEncoding: job_.cancel(); break;
    case State::kAnswered:
    case State::kEnded: break;
  }
}

void ServedCall::set_state(State next) {
  // The order of the states counts. Up to kHandedOver the gate knows the call, which holds a place
  // there. From kAnswered on no time limit applies: the server has done its part.
  CallGate& gate = service_offer_.service().gate();
  const bool was_at_gate = state_ <= State::kHandedOver;
  leave();
  state_ = next;
  const bool is_at_gate = state_ <= State::kHandedOver;
  if (was_at_gate && !is_at_gate) gate.leave(service_offer_.link(), id_);
  if (state_ == State::kDecoding) gate.preparing(service_offer_.link(), id_);
  if (state_ >= State::kAnswered) timer_.cancel();
}

void ServedCall::keep_copy() {
  if (state_ == State::kWaiting) request_.body = out_of_packet(request_.body);
}

void ServedCall::begin(const Now& now) {
  const bool waits = request_.codec != Codec::kNone && exports_.jobs.is_large(request_.raw_bytes);
  if (waits) keep_copy();  // for a worker
  // The request is moved out first: leave() would release it with the state.
  const InMessage request = std::move(request_);
  if (request.codec == Codec::kNone) return hand_over(request.body, now);
  if (waits) {
    set_state(State::kDecoding);
    job_ = exports_.jobs.decompress(*this, request.codec, request.raw_bytes, request.body,
                                    service_offer_.turn());
    return;
  }
  auto raw = decompress(request.body.view(), request.codec, request.raw_bytes);
  if (!raw) return service_offer_.on_malformed(*this);
  hand_over(Payload::adopt(std::move(raw).value()), now);
}

void ServedCall::hand_over(Payload request, const Now& now) {
  set_state(State::kHandedOver);
  handed_over_at_ = now.steady;
  invocation_ = service_offer_.service().invoke(*this, std::move(request), now);
}

void ServedCall::on_response(Payload answer, const Now& now) {
  set_state(State::kEncoding);
  const std::size_t size = answer.size();
  answer_.body = std::move(answer);
  // The bytes count before the limits are checked: the answer is in memory in any case.
  answer_bytes_ = service_offer_.load().answer_bytes.hold(size);
  if (const std::string why = service_offer_.no_room_for_answer(size); !why.empty())
    return service_offer_.withhold(*this, why, now);
  const Compression how = service_offer_.compression_of(size);
  if (how.codec == Codec::kNone) return keep_answer(Codec::kNone, {}, now);
  if (exports_.jobs.is_large(size)) {
    answer_.codec = how.codec;  // used if the body becomes smaller
    job_ = exports_.jobs.compress(*this, how, answer_.body, service_offer_.turn());
    return;
  }
  auto body = compress(answer_.body.view(), how);
  if (!body) return keep_answer(Codec::kNone, {}, now);
  keep_answer(how.codec, Payload::adopt(std::move(*body)), now);
}

void ServedCall::on_job(std::optional<Payload> result, const Now& now) {
  if (state_ == State::kEncoding) {
    const Codec codec = result ? answer_.codec : Codec::kNone;
    return keep_answer(codec, std::move(result).value_or(Payload{}), now);
  }
  LocalService& service = service_offer_.service();  // outlives this call
  if (result) {
    hand_over(*std::move(result), now);
  } else {
    service_offer_.on_malformed(*this);
  }
  // Malformed or not, the room that was reserved at the server is free or used now.
  service.begin_calls(now);
}

// kNone: the call keeps the body that it has.
void ServedCall::keep_answer(Codec codec, Payload body, const Now& now) {
  set_state(State::kAnswered);
  answer_.subject = id_;
  answer_.stamp = now.system;
  answer_.codec = codec;
  answer_.raw_bytes = static_cast<std::uint32_t>(answer_.body.size());
  answer_.tracked = true;
  if (codec != Codec::kNone) {
    answer_bytes_.resize(body.size());
    answer_.body = std::move(body);
  }
  service_offer_.on_answer(*this, now);
}

}  // namespace connect_bridge
