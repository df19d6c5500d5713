// One call of a peer at a local service.
#pragma once

#include <cstdint>

#include "core/base/budget.hpp"
#include "core/base/ids.hpp"
#include "core/base/timers.hpp"
#include "core/flow/channel_queue.hpp"
#include "core/flow/reassembly.hpp"
#include "core/jobs/jobs.hpp"

namespace connect_bridge {

class ServiceOffer;
class LocalService;
class ServedCall;
class LocalServices;

// A deadline of a call. Without `call`: of a service offer, whose peer has not attached again.
// Without both: of a service, whose server may have room again.
struct CallDue {
  LocalService* service = nullptr;
  ServiceOffer* service_offer = nullptr;
  ServedCall* call = nullptr;
};

// Lives from the arrival of the request until the peer has the answer or does not want it. The call
// holds its shares of the link's budgets, its places at the gate, its job, its timer and its
// invocation. set_state() and the destructors give back each of them, however the call ends. Owned
// by its service offer.
class ServedCall final : public JobOwner {
 public:
  enum class State : std::uint8_t {
    kWaiting,     // at the gate; the request is kept
    kDecoding,    // a worker decompresses the request
    kHandedOver,  // the server has the request
    kEncoding,    // a worker compresses the answer
    kAnswered,    // the answer is kept until the peer has it
    kEnded
  };

  // A new call, which waits.
  ServedCall(ServiceOffer& service_offer, CallId id, InMessage request, const Now& now);
  ServedCall(const ServedCall&) = delete;
  ServedCall& operator=(const ServedCall&) = delete;

  [[nodiscard]] ServiceOffer& offer() { return service_offer_; }
  [[nodiscard]] CallId id() const { return id_; }
  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] TimePoint since() const { return since_; }  // its request arrived
  [[nodiscard]] const OutMessage& answer() const { return answer_; }
  // The server has had the request since before this time.
  [[nodiscard]] bool handed_over_before(TimePoint time) const {
    return state_ == State::kHandedOver && handed_over_at_ < time;
  }

  // Copies the request, because it waits and must not keep its packet in memory.
  void keep_copy();
  // Hands the request to a worker or to the server. The service offer may have destroyed the call
  // when this returns.
  void begin(const Now& now);
  // Takes the server's answer. The call may have been destroyed when this returns.
  void on_response(Payload answer, const Now& now);
  void on_job(std::optional<Payload> result, const Now& now) override;
  // Ends the call: nobody wants the answer any longer, or there will be none.
  void end() { set_state(State::kEnded); }

 private:
  // Changes the state; the only place that does. Leaves the old state and enters the new one, with
  // all that belongs to both.
  void set_state(State next);
  void leave();
  void hand_over(Payload request, const Now& now);
  void keep_answer(Codec codec, Payload body, const Now& now);

  ServiceOffer& service_offer_;
  LocalServices& exports_;
  CallId id_;
  TimePoint since_;
  State state_ = State::kWaiting;
  Budget::Hold call_, waiting_;  // its share of the link's calls, and of the waiting ones
  Budget::Hold request_bytes_, answer_bytes_;
  Timers<CallDue>::Timer timer_;
  InMessage request_;
  Jobs::Job job_;
  InvocationId invocation_;
  TimePoint handed_over_at_{};
  OutMessage answer_;
};

}  // namespace connect_bridge
