// The peers' services that exist here: their mirrors, and the way of a call from a local caller to
// a link and back.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/base/log_limit.hpp"
#include "core/flow/reassembly.hpp"
#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"
#include "core/jobs/encoder.hpp"
#include "core/link/link.hpp"
#include "core/ports/outputs.hpp"
#include "core/ports/status.hpp"

namespace connect_bridge {

struct SideOptions;

// One mirror (a local service server) per service. Of several links that offer it one feeds it, the
// others stand by. The mirror exists while the feeding link is attached, or lost and not yet dead;
// what is known of its calls lives as long (docs/protocol.md, "Services and actions").
// Single-threaded; owned by the side.
class ServiceImports {
 public:
  ServiceImports(const SideOptions& options, const Policy& policy, const GraphView& graph,
                 const Claims& claims, LinkTable& links, Jobs& jobs, Outputs& outputs);
  ~ServiceImports();

  // The caller has found the number unused and expects data on it.
  void on_offer(Link& link, const ChannelOffer& offer, const Now& now);
  // The first round of offers is over: what the link has not offered again it will not.
  void forget_orphans(LinkId link, const Now& now);
  // False: no service was offered under this number.
  bool on_withdraw(Link& link, ChannelId channel, const Now& now);
  Result<Nothing> on_attached(Link& link, const Attached& attached, const Now& now);
  Result<Nothing> on_refuse(Link& link, const Refuse& refuse, const Now& now);
  // Nullopt: no service was offered under this number.
  std::optional<Result<Nothing>> on_message(Link& link, InMessage& message);
  void on_delivered(Link& link, ChannelId channel, CallId call);

  // The connection is gone: the mirror and its calls wait for the link's return.
  void on_link_lost(LinkId link);
  // The link is declared dead: its mirrors vanish, and their calls with them.
  void on_link_dead(LinkId link, const Now& now);
  void on_graph(const Now& now);   // servers here changed
  void on_claims(const Now& now);  // what other bridges mirror changed
  void on_policy(const Now& now);

  // The action (local name) whose goals come to this mirror, if there is one.
  [[nodiscard]] std::optional<std::string> action_of(ServiceMirrorId mirror) const;
  void on_request(RequestTaken& request, const Now& now);
  void on_callers_gone(const CallersGone& gone);
  void on_mirror_failed(const ServiceMirrorFailed& failed);
  bool on_job(const JobDone& done);  // false: not ours
  void on_time(const Now& now);

  // Whether requests are sent on this channel of ours.
  [[nodiscard]] bool sends_on(LinkId link, ChannelId channel) const {
    return by_requests_.contains({link, channel});
  }
  // What stands for the services mirrored here in our own claim; true once after every change.
  bool take_claim_change() { return std::exchange(claim_changed_, false); }
  void add_mirrored(std::vector<Gid>& claim) const;

  [[nodiscard]] std::optional<TimePoint> deadline() const;
  void add_status(const Link& link, LinkStatus& status) const;
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  using ChannelKey = std::pair<LinkId, ChannelId>;
  using TimerKey = std::pair<TimePoint, std::uint64_t>;  // the second makes it unique

  struct Call {
    RequestId request;  // none: nobody waits for the answer any longer
    OutMessage body;    // kept until the peer has it; empty while it is compressed
    bool encoded = false;
    bool delivered = false;
    std::uint64_t kept_bytes = 0;
    JobId job;  // the answer is being decompressed
    std::uint64_t decoding_bytes = 0;
    std::optional<TimerKey> timer;
  };
  struct Import;
  // A link that offers the service. Without a channel: the link is lost, or has not offered it
  // again yet.
  struct Feed final : JobOwner {
    void on_job(std::optional<Payload> result, const Now& now) override {
      encoder->finish(std::move(result));
      imports->send_encoded(*this, now);
    }

    ServiceImports* imports = nullptr;
    Import* import = nullptr;
    LinkId link;
    ChannelId channel;
    ChannelId requests;  // none: not attached, and not asked to be
    bool attached = false;
    std::uint32_t epoch = 0;
    std::string node;
    std::string action_type;
    std::string type_hash;
    Decision decision;
    CallId last;
    std::map<CallId, Call> calls;
    std::unordered_map<RequestId, CallId> by_request;
    std::optional<Encoder> encoder;  // none: requests are not compressed
    ServiceStatus counts;
  };
  struct Import {
    ServiceKey key;
    bool results = false;
    std::map<LinkId, Feed> feeds;
    LinkId feeder;  // the one that is attached
    ServiceMirrorId mirror;
    std::optional<TimePoint> mirror_at;  // claimed, and when other bridges have had time to object
    bool failed = false;                 // until it is offered again
  };
  // What the calls to one peer take, all services together.
  struct PeerLoad {
    std::uint32_t calls = 0;
    std::uint64_t request_bytes = 0;   // not known to have arrived
    std::uint64_t decoding_bytes = 0;  // of answers
    LogLimit refusals, timeouts;
  };
  using Calls = std::map<CallId, Call>;

  // ---- service_imports.cpp
  void decline(Link& link, ChannelId channel, const std::string& code, const std::string& reason);
  [[nodiscard]] std::optional<Decision> permission(const Link& link, const Feed& feed) const;
  // Does what follows from what is known now. The import may be gone afterwards.
  void update(Import& import, const Now& now);
  [[nodiscard]] bool may_exist(const Import& import, const Feed& feed);
  void attach(Import& import, Feed& feed, const Now& now);
  void create_mirror(Import& import, const Feed& feed);
  // The attachment of the feeding link ends, and the mirror.
  void close(Import& import);
  void destroy_mirror(Import& import);
  void remove_feed(Import& import, LinkId link);
  void start_encoder(Feed& feed);
  void send_encoded(Feed& feed, const Now& now);
  void tell_once(LogLevel level, const std::string& text);

  // ---- service_imports_calls.cpp
  [[nodiscard]] std::string no_room(const Feed& feed, std::size_t bytes);
  void encoded(Feed& feed, CallId id, Codec codec, const Payload& raw, const Payload& body,
               const Now& now);
  void push(Feed& feed, Calls::iterator at, const Now& now);
  void note_refusal(Feed& feed, const std::string& why, const Now& now);
  // After an attachment: what the peer has, what it has lost, what is to be sent again.
  void reconcile(Feed& feed, const Attached& attached, const Now& now);
  void respond(Feed& feed, Calls::iterator call, const Payload& answer);
  // Nobody waits for this call any longer: the peer is told, now or when it has the request.
  void abandon(Feed& feed, Calls::iterator call, std::vector<CallId>& forget);
  void erase(Feed& feed, Calls::iterator call);
  void end_calls(Feed& feed);
  void keep(Feed& feed, Call& call, std::uint64_t bytes);
  PeerLoad& load_of(const Feed& feed) { return loads_[feed.link]; }
  [[nodiscard]] Feed* feeding(Import& import);

  const SideOptions& options_;
  const Policy& policy_;
  const GraphView& graph_;
  const Claims& claims_;
  LinkTable& links_;
  Jobs& jobs_of_encoders_;
  Outputs& outputs_;
  std::map<ServiceKey, Import> imports_;
  std::map<ChannelKey, Feed*> channels_;  // null: declined
  std::map<ChannelKey, Feed*> by_requests_;
  std::unordered_map<ServiceMirrorId, Import*> by_mirror_;
  std::unordered_map<JobId, std::pair<Feed*, CallId>> jobs_;
  std::map<TimerKey, std::pair<Feed*, CallId>> timers_;
  std::uint64_t last_timer_ = 0;
  std::map<LinkId, PeerLoad> loads_;
  std::optional<TimePoint> graph_since_;  // no mirror before the local graph has been discovered
  std::optional<TimePoint> settles_at_;   // the first mirror_at without a mirror
  bool claim_changed_ = false;
  std::set<std::string> told_;  // what was logged
};

}  // namespace connect_bridge
