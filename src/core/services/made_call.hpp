// One call of a local caller at the service of a peer.
#pragma once

#include <cstdint>

#include "core/base/budget.hpp"
#include "core/base/ids.hpp"
#include "core/base/timers.hpp"
#include "core/flow/channel_queue.hpp"
#include "core/flow/reassembly.hpp"
#include "core/jobs/jobs.hpp"

namespace connect_bridge {

class PeerService;

// Lives from the request until there is an answer or nobody waits for one. The request is kept
// until the peer is known to have it, because another connection may have to carry it again. A call
// whose caller is gone is kept while its request is on its way: control messages overtake requests,
// so `forget` may be sent only when the peer has the request. Owned by its peer service.
class MadeCall final : public JobOwner {
 public:
  enum class State : std::uint8_t {
    kEncoding,  // a worker compresses the request
    kKept,      // the request can be sent, or is on its way
    kDelivered  // the peer has it
  };

  // `bytes`: size of the request.
  MadeCall(PeerService& peer_service, CallId id, RequestId request, std::uint64_t bytes,
           const Now& now);
  MadeCall(const MadeCall&) = delete;
  MadeCall& operator=(const MadeCall&) = delete;

  [[nodiscard]] PeerService& feed() { return peer_service_; }
  [[nodiscard]] CallId id() const { return id_; }
  // None: nobody waits for the answer.
  [[nodiscard]] RequestId request() const { return request_; }
  [[nodiscard]] TimePoint since() const { return since_; }
  [[nodiscard]] bool is_kept() const { return state_ == State::kKept; }
  [[nodiscard]] bool is_delivered() const { return state_ == State::kDelivered; }
  // The answer has arrived, and a worker decompresses it.
  [[nodiscard]] bool has_answer() const { return static_cast<bool>(job_); }
  // The request to send; empty before kKept and in kDelivered.
  [[nodiscard]] const OutMessage& message() const { return message_; }

  void keep(Codec codec, std::uint32_t raw_bytes, const Payload& body);
  void on_delivered();
  void forget_caller() { request_ = {}; }
  // The timer of the call is due: true when the rule's `call_timeout` is over. Else the call has
  // had no answer for kLong, which is said once.
  [[nodiscard]] bool times_out(const Now& now);
  static constexpr Duration kLong = std::chrono::seconds(10);
  // Lets a worker decompress the answer; the result goes to PeerService::on_decoded(). False: there
  // is no room for the bytes.
  [[nodiscard]] bool decode(const InMessage& answer);
  void on_job(std::optional<Payload> result, const Now& now) override;

 private:
  PeerService& peer_service_;
  CallId id_;
  RequestId request_;
  State state_ = State::kEncoding;
  OutMessage message_;
  Budget::Hold call_, request_bytes_, answer_bytes_;
  TimePoint since_;
  TimePoint ends_ = TimePoint::max();  // by its rule's `call_timeout`
  Timers<MadeCall*>::Timer timer_;
  Jobs::Job job_;
};

}  // namespace connect_bridge
