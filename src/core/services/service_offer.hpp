// A local service, offered on one link.
// One unit: the offer, both its channels and its calls begin and end together.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "core/connection/channel.hpp"
#include "core/link/link.hpp"
#include "core/offers/link_offer.hpp"
#include "core/policy/policy.hpp"
#include "core/ports/status.hpp"
#include "core/services/calls.hpp"
#include "core/services/sent_goals.hpp"
#include "core/services/served_call.hpp"

namespace connect_bridge {

class LocalService;

[[nodiscard]] inline GoalSender sender_of(const Link& link) {
  return {link.id, link.login.identity().name, link.peer().side, link.owner()};
}

// The service is offered on a channel of ours. The peer attaches to it with a channel of its own,
// which carries its requests. The state of its calls outlives the connection, so that no request is
// executed twice and no answer is lost (docs/protocol.md, "Services and actions").
//
// Within one epoch a call number means the same call. `seen` states up to which number requests
// have arrived, and an answer is kept until the peer is known to have it. After a reconnect the
// service is offered with its old epoch, and `attached` lists the calls that are still known. The
// peer sends again the requests that were not seen, and gives up the calls that were seen and are
// not listed.
//
// The state is lost when the server is replaced, or the numbers are used up. This object is then
// destroyed, and a new one begins another epoch. So the peer never mistakes old numbers for new
// calls.
//
// Owned by its local service. Some functions may make the service destroy it; their comments say
// so.
class ServiceOffer final : public OutgoingChannel, public IncomingChannel {
 public:
  ServiceOffer(LocalService& service, Link& link, LocalServices& exports);
  ServiceOffer(const ServiceOffer&) = delete;
  ServiceOffer& operator=(const ServiceOffer&) = delete;

  // ---- the offer
  // The offer, once for each connection and set of rules; nullopt: the peer may not have it.
  [[nodiscard]] std::optional<ChannelOffer> offer(const Now& now);
  [[nodiscard]] bool is_due() const { return offer_.is_due(); }
  // Applies changed rules, `accepts` or actions. Returns the reason if the offer ends
  // (LinkOffer::review).
  [[nodiscard]] std::optional<Ending> review();
  // The connection is lost: calls go on, answers wait for the link's return.
  void on_link_lost();
  // No state is left that another connection could need.
  [[nodiscard]] bool is_idle() const { return !held_ && calls_.empty(); }
  // Ends both channels and all calls.
  void end(const Ending& why, const Now& now);
  [[nodiscard]] bool is_offered() const { return offer_.is_open(); }
  // The server can be called.
  void on_ready(const Now& now);
  // Attached on this connection or the previous one: the service needs its client.
  [[nodiscard]] bool holds_client() const { return held_; }
  // The peer has not attached again in time.
  void detach(const std::string& why, const Now& now);

  // ---- messages of the peer; errors close the connection
  void on_decline(const Decline& decline, const Now& now) override;
  Result<Nothing> on_attach(const Attach& attach, const Now& now) override;
  Result<Nothing> on_forget(const Forget& forget, const Now& now) override;
  void on_delivered(CallId call, const Now& now) override;
  // May destroy this object, when the call numbers are used up.
  Result<Nothing> on_message(InMessage message, const Now& now) override;
  void on_withdraw(const Withdraw& why, const Now& now) override;

  // ---- its calls
  // Begins a call that the gate has chosen.
  void begin(CallId call, const Now& now);
  void on_failed(ServedCall& call, const std::string& reason, const Now& now);
  void on_timeout(ServedCall& call, const Now& now);
  // Ends the calls that were handed over before this time. Only servers that are gone could answer
  // them, so they would never give back their places.
  void end_lost(TimePoint before, const Now& now);

  // ---- for its calls
  // Takes the answer of a call; it is sent if the peer is attached.
  void on_answer(ServedCall& call, const Now& now);
  // Refuses a call whose answer exists but cannot be sent. Destroys the call.
  void withhold(ServedCall& call, const std::string& why, const Now& now);
  // Closes the connection, because the request does not decompress. Destroys the call.
  void on_malformed(ServedCall& call);
  // The reason why an answer of this size cannot be kept; empty if it can.
  [[nodiscard]] std::string no_room_for_answer(std::size_t bytes) const;
  [[nodiscard]] LocalService& service() { return service_; }
  [[nodiscard]] LocalServices& exports() { return exports_; }
  [[nodiscard]] CallLoad& load() { return load_; }
  [[nodiscard]] const Treatment& treatment() const { return offer_.treatment(); }
  // A line for the audit log; nullopt: there is no audit log.
  [[nodiscard]] std::optional<Audit> line_of_call(AuditEvent event,
                                                  const std::string& why = {}) const;
  // The compression of an answer of this size before it is queued.
  [[nodiscard]] Compression compression_of(std::size_t bytes) const;
  [[nodiscard]] LinkId link() const { return link_.id; }
  [[nodiscard]] const Payer& payer() const { return link_.account->time; }
  [[nodiscard]] GoalSender sender() const { return sender_of(link_); }
  [[nodiscard]] JobTurn turn() const { return link_.turn(); }

  void add_status(LinkStatus& status) const;
  void add_channel(std::vector<ChannelFacts>& channels) const;

 private:
  void admit();
  void send_attached(const Now& now);
  void end_calls(const std::string& why, const Now& now);
  void take(InMessage message, const Now& now);
  [[nodiscard]] std::string no_room_for_request(std::size_t bytes) const;
  void refuse(CallId call, const std::string& code, const std::string& reason);
  void note_refusal(const std::string& what, const std::string& why, const Now& now);
  void note_losses(std::uint64_t calls, const std::string& why, const Now& now);
  void push(ServedCall& call, const Now& now);
  void erase(ServedCall& call);

  LocalService& service_;
  Link& link_;
  LocalServices& exports_;
  CallLoad& load_;
  LinkOffer offer_;
  ChannelId requests_;               // none: the peer has not attached
  bool held_ = false;                // attached on this connection or the previous one
  bool attached_ = false;            // `attached` was sent on this connection
  Timers<CallDue>::Timer not_back_;  // offered again: calls end then unless the peer attaches
  std::uint32_t epoch_ = 0;
  CallId seen_;
  std::map<CallId, ServedCall> calls_;
  ServiceStatus counts_;
};

}  // namespace connect_bridge
