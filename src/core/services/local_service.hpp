// A service of the local graph that has a real server.
// One unit: servers, client, offers and calls of a service begin and end each other.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include "core/base/course.hpp"
#include "core/policy/policy.hpp"
#include "core/services/call_gate.hpp"
#include "core/services/service_offer.hpp"

namespace connect_bridge {

// Owns the knowledge about its servers from the graph, the one client that calls them, and one
// service offer for each link. The client exists while some link is attached. All calls end when
// the server goes or is replaced: a new server does not know them.
class LocalService {
 public:
  LocalService(ServiceKey key, LocalServices& exports);
  LocalService(const LocalService&) = delete;
  LocalService& operator=(const LocalService&) = delete;

  // ---- the graph
  void update_servers(const ServiceState& state, const Now& now);
  // The server is gone: no call begins any more.
  void leave();
  // Ends all service offers and the client. end_some(): as many offers as `course` allows; true:
  // none is left.
  void end(const Now& now);
  [[nodiscard]] bool end_some(Course& course, const Now& now);

  // ---- links
  // Was nothing decided for the link, or may it be decided again?
  [[nodiscard]] bool is_due(LinkId link) const;
  // Returns the offer for the link, if it is due. A service that cannot be called is not offered.
  [[nodiscard]] std::optional<ChannelOffer> offer(Link& link, const Now& now);
  // Applies changed rules, `accepts` or actions: ends an offer that the link may not have any
  // longer, or applies the new rules to it.
  void review(Link& link, const Now& now);
  void on_link_lost(LinkId link);
  // Ends its calls. An offer without calls ends with the connection.
  void on_link_dead(LinkId link, const Now& now);

  // ---- the client
  void on(const ServiceReady& ready, const Now& now);
  void on(ResponseTaken& response, const Now& now);
  void on(const InvocationFailed& failed, const Now& now);
  void on(const ServiceClientFailed& failed, const Now& now);
  // Begins the calls whose turn it is. Call it after everything that may free a place.
  void begin_calls(const Now& now);

  // ---- for its service offers and their calls
  void use_client();
  // Destroys the client, unless another service offer holds it.
  void release_client();
  // Ends and destroys the service offer of this link; the link receives a new offer.
  void renew(LinkId link, const Now& now);
  // Hands the request over to the server.
  InvocationId invoke(ServedCall& call, Payload request, const Now& now);
  // Asks the server to cancel a goal, as soon as it can be called. This is the service that
  // cancels.
  void cancel(SentGoal goal);
  // Drops the answer, if one can still come.
  void drop(InvocationId invocation);

  [[nodiscard]] const ServiceKey& key() const { return what_->key; }
  [[nodiscard]] const std::shared_ptr<const LocalInterface>& what() const { return what_; }
  [[nodiscard]] const std::string& node() const { return node_; }
  // True for a service that returns results of goals. Answers come when a goal has ended, so there
  // is no timeout, and a separate limit.
  [[nodiscard]] bool gives_results() const { return gives_results_; }
  [[nodiscard]] ServiceClientId client() const { return client_; }
  [[nodiscard]] CallGate& gate() { return gate_; }
  [[nodiscard]] bool is_ready() const { return ready_; }
  [[nodiscard]] bool has_several_servers() const { return has_several_servers_; }
  [[nodiscard]] const std::string& type_hash() const { return type_hash_; }

  void add_status(const Link& link, LinkStatus& status) const;
  void add_channels(const Link& link, std::vector<ChannelFacts>& channels) const;

 private:
  using ServiceOffers = std::map<LinkId, ServiceOffer>;

  void lose_server();
  // Links whose service offer has ended may be due.
  void offer_again();
  // Ends the service offer, and the client if no other offer holds it.
  void remove(ServiceOffers::iterator service_offer, const Ending& why, const Now& now);
  void forget_ended();
  void end_lost(const Now& now);
  void note_action_use(bool on);
  // Logs what holds up calls that wait.
  void tell_wait(const Now& now);
  ServedCall* take_invocation(InvocationId invocation);
  // Remembers a goal that its rule ends when its sender is gone.
  void note_goal(ServedCall& call, const Payload& request, InvocationId invocation);
  void send_own();
  void forget_own();
  // The goal that this request of our own cancels; nullopt: it is a peer's.
  [[nodiscard]] std::optional<SentGoal> end_own(InvocationId invocation);
  void on_cancel_answered(const SentGoal& goal, ByteView answer);

  LocalServices& exports_;
  std::shared_ptr<const LocalInterface> what_;
  bool gives_results_;
  std::string action_;  // whose goals come here; empty: none
  std::string node_;
  bool lacks_type_ = false;
  std::map<Gid, TimePoint> servers_;  // ids, with the time since when each is known
  bool has_several_servers_ = false;
  bool warned_several_ = false;
  ServiceClientId client_;  // none: no link is attached
  bool ready_ = false;
  bool leaving_ = false;  // the server is gone
  // The client could not be made. The next try follows when servers change, or when a link
  // attaches.
  bool failed_ = false;
  std::string type_hash_;
  CallGate gate_;
  Timers<CallDue>::Timer room_;         // calls wait for room in the server's queue
  Timers<CallDue>::Timer wait_logged_;  // calls wait: when that is logged
  std::unordered_map<InvocationId, ServedCall*> invocations_;  // requests that the gateway has
  std::deque<SentGoal> to_cancel_;                             // that wait for the server
  static constexpr std::size_t kOwnAtOnce = 8;
  std::map<InvocationId, SentGoal> own_;  // requests to cancel that the gateway has
  ServiceOffers service_offers_;
};

}  // namespace connect_bridge
