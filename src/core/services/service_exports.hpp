// The services of the local graph that peers may call: what is offered to whom, and the way of a
// call from a link to the real server and back.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/base/log_limit.hpp"
#include "core/base/random.hpp"
#include "core/flow/reassembly.hpp"
#include "core/graph/actions.hpp"
#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"
#include "core/link/link.hpp"
#include "core/ports/outputs.hpp"
#include "core/ports/status.hpp"
#include "core/services/server_queue.hpp"

namespace connect_bridge {

struct SideOptions;

// How long a server may answer nothing before it is presumed to have taken what it was given: those
// of services, and of actions' results, which are taken at once and answered when a goal ends.
inline constexpr Duration kSilenceMax = std::chrono::seconds(5);
inline constexpr Duration kResultSilenceMax = std::chrono::seconds(1);

// A service is exported while it has a real server. Per service there is at most one client, held
// while any link is attached to it. What is known of a link's calls outlives its connections, until
// the link is dead or the server goes: so that no request is executed twice and no answer is lost
// (docs/protocol.md, "Services and actions"). Single-threaded; owned by the side.
class ServiceExports {
 public:
  ServiceExports(const SideOptions& options, const Policy& policy, const GraphView& graph,
                 const Claims& claims, const LocalActions& actions, Random& random,
                 LinkTable& links, Outputs& outputs);
  ~ServiceExports();

  // Servers, or what other bridges claim, have changed.
  void on_graph(const Now& now);
  // Withdraws what is no longer allowed to the link, and treats the rest by the rules of now.
  // Between hold() and go_on() no call starts: its own right may not have been looked at yet.
  void recheck(Link& link, const Now& now);
  void hold() { holds_ = true; }
  void go_on(const Now& now);
  // Adds what is to be offered to the link and is not yet.
  void collect_offers(Link& link, std::vector<ChannelOffer>& offers, const Now& now);
  // True once after something has to be offered again, without a change from outside.
  bool take_offers_due() { return std::exchange(offers_due_, false); }

  // Actions that peers can send goals to from now on, or can no longer.
  struct ActionUse {
    std::string action;  // local name
    bool on = false;
  };
  std::vector<ActionUse> take_action_uses() { return std::exchange(action_uses_, {}); }

  // The connection is gone: calls go on, answers wait for the link's return.
  void on_link_lost(LinkId link);
  // The link is declared dead: its calls end.
  void on_link_dead(LinkId link, const Now& now);

  // Errors end the connection. A message that crossed our withdraw is none.
  Result<Nothing> on_attach(Link& link, const Attach& attach, const Now& now);
  Result<Nothing> on_forget(Link& link, const Forget& forget, const Now& now);
  // False: no channel of requests that this side knows.
  bool on_withdraw(Link& link, ChannelId requests, const Now& now);
  // False: no service is offered under this number.
  bool on_decline(Link& link, const Decline& decline, const Now& now);
  // Nullopt: no channel of requests.
  std::optional<Result<Nothing>> on_message(Link& link, InMessage& message, const Now& now);
  void on_delivered(LinkId link, ChannelId channel, CallId call);

  void on_ready(const ServiceReady& ready, const Now& now);
  void on_response(ResponseTaken& response, const Now& now);
  void on_invocation_failed(const InvocationFailed& failed, const Now& now);
  void on_client_failed(const ServiceClientFailed& failed, const Now& now);
  bool on_job(const JobDone& done, const Now& now);  // false: not ours
  void on_time(const Now& now);

  [[nodiscard]] bool is_offered(LinkId link, ChannelId channel) const {
    return by_channel_.contains({link, channel});
  }
  [[nodiscard]] std::optional<TimePoint> deadline() const;
  void add_status(const Link& link, LinkStatus& status) const;
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  using ChannelKey = std::pair<LinkId, ChannelId>;
  using TimerKey = std::pair<TimePoint, std::uint64_t>;  // the second makes it unique
  // kWaiting: for a place; kInLine: it has one, and waits for the server's queue. Both keep the
  // request.
  enum class CallState : std::uint8_t {
    kWaiting,
    kInLine,
    kDecoding,
    kInFlight,
    kEncoding,
    kAnswered
  };

  struct Call {
    CallState state = CallState::kWaiting;
    InMessage request;
    InvocationId invocation;
    TimePoint invoked{};
    JobId job;          // kDecoding, kEncoding
    OutMessage answer;  // kEncoding: raw; kAnswered: kept until the peer has it
    std::optional<TimerKey> timer;
  };
  struct Service;
  // A service for one link.
  struct Served {
    Service* service = nullptr;
    LinkId link;
    Decision decision;
    bool considered = false;  // for this connection and these rules; without a channel: "no"
    ChannelId channel;
    ChannelId requests;     // none: not attached
    bool held = false;      // attached on this connection or the one before: needs the client
    bool attached = false;  // and told so
    bool hungry = false;    // in PeerLoad::hungry
    std::optional<TimerKey> forgotten_at;  // offered again: without an attach its calls end then
    std::uint32_t epoch = 0;
    CallId seen;
    std::map<CallId, Call> calls;
    std::set<CallId> waiting;
    CallId in_line;  // one at most, so that links take turns
    CallId decoding;
    std::uint32_t in_flight = 0;
    ServiceStatus counts;
  };
  struct Service {
    ServiceKey key;
    std::string node;
    std::map<Gid, TimePoint> servers;  // and since when they are there
    bool warned_several = false;
    ServiceClientId client;  // none: nobody is attached
    bool ready = false;
    bool failed = false;   // the client could not be made; tried again when servers change
    bool results = false;  // answers when a goal has ended: no time limit, a bound of its own
    std::string type_hash;
    std::map<LinkId, Served> links;
    ServerQueue queue{kSilenceMax};  // of the client's server
    std::uint32_t decoding = 0;      // of all links: they have room in the queue
    std::deque<Served*> line;        // whose calls wait for room in the queue
    std::optional<TimerKey> line_timer;
  };
  // What one peer's calls take, all services together.
  struct PeerLoad {
    std::uint32_t in_flight = 0;  // without those for results
    std::uint32_t waiting = 0;
    std::uint32_t calls = 0;
    std::uint64_t request_bytes = 0;   // waiting
    std::uint64_t answer_bytes = 0;    // not known to have arrived
    std::uint32_t ended_channels = 0;  // of requests, whose end the peer has not confirmed
    std::deque<Served*> hungry;        // have calls that wait for a place of the link, in turn
    TimePoint attaches_paid_until{};   // each takes a while of a peer's time
    LogLimit refusals, timeouts;
  };
  using Calls = std::map<CallId, Call>;

  // ---- service_exports.cpp
  void renew(Served& served, const Now& now);
  void remove(Service& service, const Now& now);
  [[nodiscard]] std::optional<Decision> permission(const Link& link, const ServiceKey& key) const;
  [[nodiscard]] QueueOptions queue_options(const Served& served) const;
  [[nodiscard]] ChannelOffer open_channel(Served& served, Link& link);
  // The channel ends, and all calls with it. The caller erases it or offers it anew.
  void end(Served& served, const Now& now);
  void end_calls(Served& served, const Now& now);
  // Nobody is attached any longer, and will not come back.
  void let_go(Served& served, const Now& now);
  void send_attached(Served& served, Link& link, const Now& now);

  // ---- service_exports_servers.cpp
  void update_servers(Service& service, const ServiceState& state, const Now& now);
  void renew(Service& service, const Now& now);
  // Ends the calls that were handed over before the first of the servers of now was there.
  void end_lost(Service& service, const Now& now);
  void use_client(Service& service);
  void note_action_use(const Service& service, bool on);
  void release_client(Service& service);

  // ---- service_exports_calls.cpp
  Result<Nothing> take(Link& link, Served& served, InMessage message, const Now& now);
  // Why a further call cannot be kept; empty if it can.
  [[nodiscard]] std::string no_room(const Served& served, const PeerLoad& load,
                                    const InMessage& message) const;
  void refuse(Served& served, CallId call, const std::string& code, const std::string& reason);
  void encode(Served& served, CallId id, Call& call, Payload raw, const Now& now);
  void answer(Served& served, CallId id, Call& call, Codec codec, Payload body, const Now& now);
  void push(Served& served, CallId id, const Call& call, const Now& now);
  void withhold(Served& served, CallId id, const std::string& why, const Now& now);
  void push_answers(Served& served, const Now& now);

  // ---- service_exports_places.cpp
  // Whether the service has one, whatever the link and the server's queue have.
  [[nodiscard]] bool has_place(const Served& served) const;
  [[nodiscard]] static bool has_room(const Served& served, const Now& now);
  // Gives what is free of the server's queue and of the link's places to calls that wait.
  void resume(Served& served, const Now& now);
  void let_in(Service& service, const Now& now);
  // This service's calls and the link's others in turn.
  void share_places(Served& served, const Now& now);
  void take_place(Served& served, const Now& now);
  void watch_line(Service& service);
  // The client goes, or all its calls do: nobody is let in any more.
  void end_line(Service& service);
  void start(Served& served, CallId id, const Now& now);
  void end_decoding(Served& served);
  void malformed(Served& served, CallId id);
  void invoke(Served& served, CallId id, Call& call, Payload request, const Now& now);
  void free_place(Served& served);
  void erase(Served& served, Calls::iterator at);
  PeerLoad& load_of(const Served& served) { return loads_[served.link]; }

  const SideOptions& options_;
  const Policy& policy_;
  const GraphView& graph_;
  const Claims& claims_;
  const LocalActions& actions_;
  Random& random_;
  LinkTable& links_;
  Outputs& outputs_;
  std::map<ServiceKey, Service> services_;
  std::map<ChannelKey, Served*> by_channel_;
  std::map<ChannelKey, Served*> by_requests_;  // null: ended, the peer's withdraw is awaited
  std::unordered_map<ServiceClientId, Service*> by_client_;
  std::unordered_map<InvocationId, std::pair<Served*, CallId>> invocations_;
  std::unordered_map<JobId, std::pair<Served*, CallId>> jobs_;
  std::map<TimerKey, std::pair<Served*, CallId>> timers_;
  std::map<TimerKey, Service*> line_timers_;
  std::uint64_t last_timer_ = 0;
  std::map<LinkId, PeerLoad> loads_;
  std::vector<ActionUse> action_uses_;
  bool offers_due_ = false;
  bool holds_ = false;
};

// Whether a service gives an action's results: such calls last as long as the goal does.
[[nodiscard]] bool is_result_service(const std::string& name);

// What one peer may have of these at a time, whatever the rules say.
inline constexpr std::uint32_t kResultCallsMax = 1000;  // per service
inline constexpr std::uint32_t kPeerCallsMax = 8192;    // of all services
// Of requests and answers together that wait in a link's outbox; also of calls that were given up.
[[nodiscard]] constexpr std::uint64_t kept_bytes_max(std::uint64_t call_bytes_max) {
  return 2 * (call_bytes_max + kPeerCallsMax * kKeptMessageBytes);
}
// Call numbers end here; an exporter begins a new epoch long before.
inline constexpr std::uint32_t kCallNumbersMax = 0xF0000000;

}  // namespace connect_bridge
