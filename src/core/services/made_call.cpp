#include "core/services/made_call.hpp"

#include <algorithm>

#include "core/services/peer_service.hpp"
#include "core/services/peer_services.hpp"

namespace connect_bridge {
namespace {

// The exporter gives up a call first, so that its refusal names the reason.
constexpr Duration kTimeoutMargin = std::chrono::seconds(1);
constexpr std::uint64_t kDecodingBytesMax = 64 << 20;  // limit for the answers of one peer

}  // namespace

MadeCall::MadeCall(PeerService& peer_service, CallId id, RequestId request, std::uint64_t bytes,
                   const Now& now)
    : peer_service_(peer_service),
      id_(id),
      request_(request),
      call_(peer_service.load().calls.hold(1)),
      request_bytes_(peer_service.load().request_bytes.hold(bytes)),
      since_(now.steady) {
  message_.subject = id;
  message_.stamp = now.system;
  message_.tracked = true;
  if (peer_service.gives_results()) return;  // they come when the goal ends
  const Duration timeout = peer_service.call_timeout();
  if (timeout != kForever)  // mutant: call_timeout
    ends_ = now.steady + timeout + kTimeoutMargin;
  timer_ = peer_service.imports().timers.set(std::min(ends_, since_ + kLong), this);
}

bool MadeCall::times_out(const Now& now) {
  if (now.steady >= ends_) return true;
  timer_.cancel();
  if (ends_ != TimePoint::max()) timer_ = peer_service_.imports().timers.set(ends_, this);
  return false;
}

void MadeCall::keep(Codec codec, std::uint32_t raw_bytes, const Payload& body) {
  if (state_ == State::kEncoding) state_ = State::kKept;
  message_.codec = codec;
  message_.raw_bytes = raw_bytes;
  message_.body = body;
  // The compressed request is kept, perhaps to be sent again.
  request_bytes_.resize(body.size());
}

void MadeCall::on_delivered() {
  state_ = State::kDelivered;
  // The exporter has the request and drops repetitions of its number, so no other connection needs
  // it (docs/protocol.md section 9.7).
  message_.body = {};
  request_bytes_.release();
}

bool MadeCall::decode(const InMessage& answer) {
  const std::uint64_t bytes = answer.body.size();
  Budget& all = peer_service_.load().answer_bytes;
  if (all.used() + bytes > kDecodingBytesMax || bytes > peer_service_.link().memory.room())
    return false;
  answer_bytes_ = all.hold(bytes);
  job_ = peer_service_.imports().jobs.decompress(*this, answer.codec, answer.raw_bytes,
                                                 out_of_packet(answer.body),
                                                 peer_service_.link().turn());
  return true;
}

void MadeCall::on_job(std::optional<Payload> result, const Now& now) {
  job_.cancel();
  peer_service_.on_decoded(*this, std::move(result), now);
}

}  // namespace connect_bridge
