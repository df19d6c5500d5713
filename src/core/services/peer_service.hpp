// A service of a peer, as one link offers it.
// One unit: calls, their numbers and the requests for results that outlast them end together; what
// one of them keeps decides which of the others a caller still waits for.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/connection/channel.hpp"
#include "core/jobs/encoder.hpp"
#include "core/link/link.hpp"
#include "core/policy/policy.hpp"
#include "core/ports/status.hpp"
#include "core/services/calls.hpp"
#include "core/services/made_call.hpp"

namespace connect_bridge {

class ServiceMirror;
class PeerServices;

// The peer offers the service on a channel of its own, which carries its answers. When this side
// attaches, requests go out on a channel of ours. The peer service outlives its connections:
// without a channel the link is lost, or has not offered the service again yet (docs/protocol.md,
// "Services and actions").
//
// After a reconnect each side knows only a part of the state. `attached` states up to which number
// requests have arrived, and which of these calls the peer still has. Requests that it has not seen
// are sent again. Calls that it has seen and no longer has were answered, refused or forgotten on
// the lost connection, and no answer will come: the caller's request is dropped. Calls that it has
// and that nobody here waits for are sent in `forget`. So each call is executed at most once, and
// ends on both sides.
//
// Requests for the results of goals also outlast the link's death, as long as the link may return:
// they are made again, under new numbers, when the same process at the peer attaches the service
// again. A caller whose goal's result will not come learns that the goal was aborted.
//
// Owned by its service mirror.
class PeerService final : public IncomingChannel, public OutgoingChannel, public JobOwner {
 public:
  PeerService(ServiceMirror& service, Link& link, PeerServices& imports);
  ~PeerService() override = default;
  PeerService(const PeerService&) = delete;
  PeerService& operator=(const PeerService&) = delete;

  // ---- what is offered
  // Takes an offer that a rule allows. The caller has checked that there is no other offer.
  void on_offer(const ChannelOffer& offer, Decision decision);
  // Takes the decision of changed rules, which still allow it.
  void on_decision(Decision decision) {
    decision_ = std::move(decision);
    if (requests_) link_.sending().add_channel(requests_, queue_of_calls(decision_));
  }
  // The connection is lost: calls wait for the link's return.
  void on_link_lost();
  // Writes the line of the audit log about the end of the channel.
  void note_end(const Ending& why) const;
  [[nodiscard]] bool is_offered() const { return static_cast<bool>(offer_.channel); }
  // The last offer; its channel is empty while there is none.
  [[nodiscard]] const ChannelOffer& offer() const { return offer_; }
  [[nodiscard]] const std::string& type_hash() const { return type_hash_; }
  [[nodiscard]] bool any_definition() const { return decision_.treatment.allow_type_mismatch; }
  // No mirror can be made of its type under the present rules.
  [[nodiscard]] bool is_unfit() const { return unfit_; }
  void set_unfit(bool unfit) { unfit_ = unfit; }
  [[nodiscard]] Link& link() const { return link_; }

  // ---- attach and detach
  // Sends `attach`. Call it only if the service is offered and not attached.
  void attach();
  [[nodiscard]] bool asked_to_attach() const { return static_cast<bool>(requests_); }
  [[nodiscard]] bool is_attached() const { return attached_; }
  // Withdraws our channel for requests, if it is open.
  void detach();
  // Gives up all calls, because their mirror is destroyed.
  void end_calls(const char* why, const Now& now);

  // ---- results after a break (docs/protocol.md section 9.7)
  // The peer has forgotten the calls. Requests for results are kept, and made again when it
  // attaches the service again. False: there are none, or the link will not return.
  [[nodiscard]] bool keep_results(const Now& now);
  // The link is dead, or was, and the service is not attached again.
  [[nodiscard]] bool keeps_results() const { return kept_for_.has_value(); }
  // Nobody waits for a result any longer.
  [[nodiscard]] bool keeps_nothing() const { return keeps_results() && results_.empty(); }
  // The peer is the one whose results are awaited.
  [[nodiscard]] bool is_awaited_peer() const { return kept_for_ == link_.login.identity().name; }

  // ---- messages of the peer; errors close the connection
  Result<Nothing> on_message(InMessage message, const Now& now) override;
  // Destroys this object, and maybe its service mirror.
  void on_withdraw(const Withdraw& why, const Now& now) override;
  Result<Nothing> on_attached(const Attached& attached, const Now& now) override;
  Result<Nothing> on_refuse(const Refuse& refuse, const Now& now) override;
  void on_delivered(CallId call, const Now& now) override;

  // ---- inputs from callers here
  void on_request(RequestId request, Payload payload, const Now& now);
  void on_callers_gone(const std::vector<RequestId>& requests);
  // The call's timer is due (MadeCall::times_out).
  void on_due(MadeCall& call, const Now& now);

  // ---- for its calls
  // Takes the answer of a call; nullopt: its bytes do not decompress. Destroys the call.
  void on_decoded(MadeCall& call, std::optional<Payload> answer, const Now& now);
  // A worker has compressed a request.
  void on_job(std::optional<Payload> result, const Now& now) override;
  [[nodiscard]] Duration call_timeout() const { return decision_.treatment.call_timeout; }
  [[nodiscard]] bool gives_results() const;
  [[nodiscard]] PeerServices& imports() { return imports_; }
  [[nodiscard]] CallLoad& load() { return load_; }

  void add_status(LinkStatus& status) const;
  void add_channel(std::vector<ChannelFacts>& channels) const;

 private:
  using Calls = std::map<CallId, MadeCall>;

  void start_encoder();
  void send_encoded(const Now& now);
  void on_encoded(CallId id, Codec codec, const Payload& raw, const Payload& body, const Now& now);
  [[nodiscard]] std::string no_room(std::size_t bytes) const;
  void push(MadeCall& call, const Now& now);
  void reconcile(const Attached& attached, const Now& now);
  // Makes the call of a request. False: there is no room, and the request is dropped.
  bool make_call(RequestId request, Payload payload, const Now& now);
  void ask_again(const Now& now);
  void respond(MadeCall& call, const Payload& answer, const Now& now);
  // Drops the caller's request and destroys the call: there will be no answer.
  void give_up(MadeCall& call);
  // The caller will get no answer.
  void drop_request(RequestId request);
  void note_losses(std::uint64_t calls, const std::string& why, const Now& now);
  // Nobody waits for this call any longer: `forget` is sent now, or when the peer has the request.
  void abandon(MadeCall& call, std::vector<CallId>& forget);
  void say_forget(std::vector<CallId> calls);
  void note_refusal(const std::string& why, const Now& now);
  void note_long(const MadeCall& call, const Now& now);
  void erase(MadeCall& call);

  ServiceMirror& service_;
  Link& link_;
  PeerServices& imports_;
  CallLoad& load_;
  ChannelOffer offer_;
  ChannelId requests_;  // none: `attach` was not sent
  bool attached_ = false;
  std::string type_hash_;
  bool unfit_ = false;
  Decision decision_;
  CallId last_;
  Calls calls_;
  std::unordered_map<RequestId, CallId> by_request_;
  // A request for a goal's result, which may be made again.
  struct Awaited {
    Payload request;
    bool again = false;
  };
  std::map<RequestId, Awaited> results_;
  std::string attached_to_;              // the identity whose server got the calls
  std::optional<std::string> kept_for_;  // the same, once the link has died
  std::optional<Encoder> encoder_;       // none: requests are not compressed
  bool long_noted_ = false;              // a long wait, and no answer in less since then
  ServiceStatus counts_;
};

}  // namespace connect_bridge
