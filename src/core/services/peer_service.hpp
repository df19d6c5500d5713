// A peer's service as one link offers it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/jobs/encoder.hpp"
#include "core/link/channel.hpp"
#include "core/link/link.hpp"
#include "core/policy/policy.hpp"
#include "core/ports/status.hpp"
#include "core/services/calls.hpp"
#include "core/services/made_call.hpp"

namespace connect_bridge {

class ServiceMirror;
class PeerServices;

// The peer offers the service on a channel of its own, on which its answers come; when this side
// attaches, requests go out on a channel of ours. The feed outlives its connections: without a
// channel the link is lost, or has not offered the service again yet (docs/protocol.md, "Services
// and actions").
//
// After a reconnect each side knows only a part of the state. `attached` says up to which number
// requests have arrived, and which of these calls the peer still has. Requests that it has not seen
// are sent again. Calls that it has seen and does not have were answered, refused or forgotten on
// the lost connection, and that answer will not come again: the caller's request is dropped. Calls
// that it has and that nobody here waits for are sent in `forget`. So each call is executed at most
// once, and ends on both sides.
//
// Owned by its mirrored service.
class PeerService final : public IncomingChannel, public OutgoingChannel, public JobOwner {
 public:
  PeerService(ServiceMirror& service, Link& link, PeerServices& imports);
  ~PeerService() override = default;
  PeerService(const PeerService&) = delete;
  PeerService& operator=(const PeerService&) = delete;

  // ---- what is offered
  // A rule allows it. The caller has checked that it is not offered already.
  void on_offer(const ChannelOffer& offer, Decision decision);
  // The rules have changed, and still allow it.
  void on_decision(Decision decision) {
    decision_ = std::move(decision);
    if (requests_) link_.sending().add_channel(requests_, queue_of_calls(decision_));
  }
  // The connection is gone: calls wait for the link's return.
  void on_link_lost();
  // For the audit log: the channel is about to end.
  void note_end(const Ending& why) const;
  [[nodiscard]] bool is_offered() const { return static_cast<bool>(offer_.channel); }
  // The last offer; without a channel while there is none.
  [[nodiscard]] const ChannelOffer& offer() const { return offer_; }
  [[nodiscard]] const std::string& type_hash() const { return type_hash_; }
  [[nodiscard]] bool any_definition() const { return decision_.treatment.allow_type_mismatch; }
  // Whether no mirror can be made of its type, as the rules are.
  [[nodiscard]] bool is_unfit() const { return unfit_; }
  void set_unfit(bool unfit) { unfit_ = unfit; }
  [[nodiscard]] Link& link() const { return link_; }

  // ---- the attachment
  // Sends `attach`. Only if it is offered and not attached.
  void attach();
  [[nodiscard]] bool asked_to_attach() const { return static_cast<bool>(requests_); }
  [[nodiscard]] bool is_attached() const { return attached_; }
  // Ends it, if there is one.
  void detach();
  // Gives up all calls, because their mirror is destroyed.
  void end_calls();

  // ---- what the peer says. Errors end the connection
  Result<Nothing> on_message(InMessage message, const Now& now) override;
  // Destroys the feed, and maybe its service.
  void on_withdraw(const Withdraw& why, const Now& now) override;
  Result<Nothing> on_attached(const Attached& attached, const Now& now) override;
  Result<Nothing> on_refuse(const Refuse& refuse, const Now& now) override;
  void on_delivered(CallId call, const Now& now) override;

  // ---- what callers here do
  void on_request(RequestId request, Payload payload, const Now& now);
  void on_callers_gone(const std::vector<RequestId>& requests);
  void on_timeout(MadeCall& call, const Now& now);

  // ---- for its calls
  // The answer of a call; nullopt: its bytes do not decompress. Destroys the call.
  void on_decoded(MadeCall& call, std::optional<Payload> answer);
  // A request has been compressed.
  void on_job(std::optional<Payload> result, const Now& now) override;
  [[nodiscard]] Duration call_timeout() const;
  [[nodiscard]] PeerServices& imports() { return imports_; }
  [[nodiscard]] CallLoad& load() { return load_; }

  void add_status(LinkStatus& status) const;

 private:
  using Calls = std::map<CallId, MadeCall>;

  void start_encoder();
  void send_encoded(const Now& now);
  void on_encoded(CallId id, Codec codec, const Payload& raw, const Payload& body, const Now& now);
  [[nodiscard]] std::string no_room(std::size_t bytes) const;
  void push(MadeCall& call, const Now& now);
  void reconcile(const Attached& attached, const Now& now);
  void respond(MadeCall& call, const Payload& answer);
  // There will be no answer: drops the caller's request and destroys the call.
  void give_up(MadeCall& call);
  void drop_request(RequestId request);
  // Nobody waits for this call any longer: `forget` is sent now, or when the peer has the request.
  void abandon(MadeCall& call, std::vector<CallId>& forget);
  void say_forget(std::vector<CallId> calls);
  void note_refusal(const std::string& why, const Now& now);
  void erase(MadeCall& call);

  ServiceMirror& service_;
  Link& link_;
  PeerServices& imports_;
  CallLoad& load_;
  ChannelOffer offer_;
  ChannelId requests_;  // none: not attached, and not asked to be
  bool attached_ = false;
  std::string type_hash_;
  bool unfit_ = false;
  Decision decision_;
  CallId last_;
  Calls calls_;
  std::unordered_map<RequestId, CallId> by_request_;
  std::optional<Encoder> encoder_;  // none: requests are not compressed
  ServiceStatus counts_;
};

}  // namespace connect_bridge
