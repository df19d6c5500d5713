// A service of the local graph that has a real server.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <unordered_map>

#include "core/policy/policy.hpp"
#include "core/services/attachment.hpp"
#include "core/services/serving.hpp"

namespace connect_bridge {

// Owns what the graph tells of its servers, the one client that calls them, and the attachments of
// the links it is offered to. There is a client while some link is attached. When the server goes
// or another one takes its place, all calls end: the new one knows nothing of them.
class RealService {
 public:
  RealService(ServiceKey key, Serving& serving);
  RealService(const RealService&) = delete;
  RealService& operator=(const RealService&) = delete;

  // ---- the graph
  void update_servers(const ServiceState& state, const Now& now);
  // All attachments end, and the client.
  void end(const Now& now);

  // ---- links
  // What the link is to be offered and is not yet.
  [[nodiscard]] std::optional<ChannelOffer> offer(Link& link, const Now& now);
  // Ends what is no longer allowed to the link, and treats the rest by the new rules.
  void recheck(Link& link, const Now& now);
  void on_link_lost(LinkId link);
  void on_link_dead(LinkId link, const Now& now);
  // Each of its callers may have free places.
  void consider_callers();
  // What our own rules and the peer's say, as far as that is known: between two connections ours
  // hold at once.
  [[nodiscard]] std::optional<Decision> permission(const Link& link, bool own_only = false) const;

  // ---- the client
  void on_ready(const ServiceReady& ready, const Now& now);
  void on_response(ResponseTaken& response, const Now& now);
  void on_invocation_failed(const InvocationFailed& failed, const Now& now);
  void on_client_failed(const ServiceClientFailed& failed, const Now& now);
  void begin(LinkId link, CallId call, const Now& now);

  // ---- for its attachments and their calls
  void use_client();
  // Unless somebody else holds it.
  void release_client();
  // The attachment of this link ends and is destroyed; the service is offered to it anew.
  void renew(LinkId link, const Now& now);
  // Gives the request to the server.
  InvocationId invoke(ServedCall& call, const CallGate::Caller& caller, Payload request,
                      const Now& now);
  // The answer is not wanted, if there can still be one.
  void drop(InvocationId invocation);

  [[nodiscard]] const ServiceKey& key() const { return key_; }
  [[nodiscard]] const std::string& node() const { return node_; }
  // Answers come when a goal has ended: no time limit, a bound of its own.
  [[nodiscard]] bool gives_results() const { return gives_results_; }
  [[nodiscard]] ServiceClientId client() const { return client_; }
  [[nodiscard]] bool is_ready() const { return ready_; }
  [[nodiscard]] const std::string& type_hash() const { return type_hash_; }

  void add_status(const Link& link, LinkStatus& status) const;

 private:
  void end_attachments(const Now& now);
  void end_lost(const Now& now);
  void note_action_use(bool on);
  ServedCall* take_invocation(InvocationId invocation);

  Serving& serving_;
  ServiceKey key_;
  bool gives_results_;
  std::string node_;
  std::map<Gid, TimePoint> servers_;  // and since when they are there
  bool warned_several_ = false;
  ServiceClientId client_;  // none: nobody is attached
  bool ready_ = false;
  // The client could not be made. Tried again when servers change, or for a link that comes later.
  bool failed_ = false;
  std::string type_hash_;
  std::unordered_map<InvocationId, ServedCall*> invocations_;  // that the gateway has
  std::map<LinkId, Attachment> attachments_;
};

}  // namespace connect_bridge
