// A service of the local graph that has a real server.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include "core/policy/policy.hpp"
#include "core/services/call_gate.hpp"
#include "core/services/service_offer.hpp"

namespace connect_bridge {

// Owns what is known of its servers from the graph, the one client that calls them, and the
// attachments of the links it is offered to. There is a client while some link is attached. When
// the server goes or is replaced, all calls end: a new server does not know them.
class LocalService {
 public:
  LocalService(ServiceKey key, LocalServices& exports);
  LocalService(const LocalService&) = delete;
  LocalService& operator=(const LocalService&) = delete;

  // ---- the graph
  void update_servers(const ServiceState& state, const Now& now);
  // All attachments end, and the client.
  void end(const Now& now);

  // ---- links
  // The offer for the link, if it is to be offered and is not yet. What cannot be called is not.
  [[nodiscard]] std::optional<ChannelOffer> offer(Link& link, const Now& now);
  // Rules, `accepts` or actions have changed: ends what the link may not have any longer, and
  // applies the new rules to the rest.
  void review(Link& link, const Now& now);
  void on_link_lost(LinkId link);
  void on_link_dead(LinkId link, const Now& now);

  // ---- the client
  void on(const ServiceReady& ready, const Now& now);
  void on(ResponseTaken& response, const Now& now);
  void on(const InvocationFailed& failed, const Now& now);
  void on(const ServiceClientFailed& failed, const Now& now);
  // Begins the calls whose turn it is. To be called after everything that may free a place.
  void begin_calls(const Now& now);

  // ---- for its attachments and their calls
  void use_client();
  // Destroys the client, unless another attachment holds it.
  void release_client();
  // Ends and destroys the attachment of this link; the service is offered to it again.
  void renew(LinkId link, const Now& now);
  // Gives the request to the server.
  InvocationId invoke(ServedCall& call, Payload request, const Now& now);
  // The answer is not wanted any more, if one can still come.
  void drop(InvocationId invocation);

  [[nodiscard]] const ServiceKey& key() const { return what_->key; }
  [[nodiscard]] const std::shared_ptr<const LocalInterface>& what() const { return what_; }
  [[nodiscard]] const std::string& node() const { return node_; }
  // Whether it returns results of goals: answers come when a goal has ended, so there is no timeout
  // and a separate limit.
  [[nodiscard]] bool gives_results() const { return gives_results_; }
  [[nodiscard]] ServiceClientId client() const { return client_; }
  [[nodiscard]] CallGate& gate() { return gate_; }
  [[nodiscard]] bool is_ready() const { return ready_; }
  [[nodiscard]] const std::string& type_hash() const { return type_hash_; }

  void add_status(const Link& link, LinkStatus& status) const;

 private:
  using ServiceOffers = std::map<LinkId, ServiceOffer>;

  [[nodiscard]] bool lacks_type() const;
  // It ends, and the client if no other one holds it.
  void remove(ServiceOffers::iterator service_offer, const Ending& why, const Now& now);
  void forget_ended();
  void end_lost(const Now& now);
  void note_action_use(bool on);
  ServedCall* take_invocation(InvocationId invocation);

  LocalServices& exports_;
  std::shared_ptr<const LocalInterface> what_;
  bool gives_results_;
  std::string node_;
  std::map<Gid, TimePoint> servers_;  // and since when each is known
  bool warned_several_ = false;
  ServiceClientId client_;  // none: no link is attached
  bool ready_ = false;
  // The client could not be made. It is tried again when servers change, or for a link that
  // attaches later.
  bool failed_ = false;
  std::string type_hash_;
  CallGate gate_;
  Timers<CallDue>::Timer room_;  // calls wait for room in the server's queue
  std::unordered_map<InvocationId, ServedCall*> invocations_;  // requests that the gateway has
  ServiceOffers service_offers_;
};

}  // namespace connect_bridge
