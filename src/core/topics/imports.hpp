// The peers' topics that exist here: channels offered to us, their mirrors, and the way of a
// message from a link to the local graph.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/flow/drops.hpp"
#include "core/flow/reassembly.hpp"
#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"
#include "core/link/link.hpp"
#include "core/ports/outputs.hpp"
#include "core/ports/status.hpp"

namespace connect_bridge {

struct SideOptions;

// One mirror (a local publisher) per origin. The same origin may be offered by several links (two
// clients in one graph): one of them feeds the mirror, the others stand by. Single-threaded; owned
// by the side.
class Imports {
 public:
  Imports(const SideOptions& options, const Policy& policy, const GraphView& graph,
          const Claims& claims, LinkTable& links, Outputs& outputs);

  // The caller has found the number unused and expects data on it. Also declines kinds of channels
  // that nobody here knows.
  void on_offer(Link& link, const ChannelOffer& offer, const Now& now);
  // Errors end the link: an unknown channel, too many origins.
  Result<Nothing> on_origins(Link& link, const OriginsChanged& change, const Now& now);
  // False: no topic was offered under this number.
  bool on_withdraw(Link& link, ChannelId channel, const Now& now);
  // Nullopt: likewise.
  std::optional<Result<Nothing>> on_message(Link& link, InMessage& message, const Now& now);

  // The connection is gone: its channels end, its mirrors wait for the link's return.
  void on_link_lost(LinkId link, const Now& now);
  // The link is declared dead: its mirrors vanish.
  void on_link_dead(LinkId link, const Now& now);
  // The link is open again, and what it has not offered again by now it will not.
  void forget_orphans(LinkId link, const Now& now);
  void on_graph(const Now& now);   // local subscribers or origins changed
  void on_claims(const Now& now);  // another bridge's claims changed
  void on_policy(const Now& now);
  // A goal is on its way to this action (local name): its feedback may follow before the graph has
  // told of the client's subscriptions.
  void expect_goal(const std::string& action, const Now& now);
  void on_mirror_failed(const MirrorFailed& failed);
  void on_publish_failed(const PublishFailed& failed);
  bool on_job(const JobDone& done, const Now& now);  // false: not ours
  void on_time(const Now& now);

  // Sends the demands that changed, one message per link and direction.
  void send_demands();
  // The origins mirrored here, for our own claim; true once after every change.
  bool take_claim_change() { return std::exchange(claim_changed_, false); }
  [[nodiscard]] std::vector<Gid> mirrored() const;

  [[nodiscard]] std::optional<TimePoint> deadline() const;
  void add_status(const Link& link, LinkStatus& status) const;
  [[nodiscard]] std::uint64_t memory_bytes() const { return decoding_bytes_; }

 private:
  using MirrorKey = std::pair<TopicKey, Gid>;  // local topic name and type, origin
  using ChannelKey = std::pair<LinkId, ChannelId>;

  // A link that offers the origin. channel 0: the link is lost, or has not offered it again yet.
  struct Candidate {
    LinkId link;
    ChannelId channel;
  };
  struct Mirror {
    MirrorKey key;
    MirrorId id;  // none: not created
    OriginOffer origin;
    Qos qos;
    std::string type_hash;
    std::string action_type;
    std::vector<Candidate> candidates;    // the feeding one first
    std::optional<TimePoint> settles_at;  // no demand before: other bridges may claim the origin
    std::optional<TimePoint>
        ends_at;  // all candidates gone: lets the middleware deliver the last samples
    std::optional<TimePoint> demanded_until;  // whether there is a subscriber or not
    Stamp last_stamp = 0;
    LinkId fed_by;          // whose message was published last
    bool is_local = false;  // the origin lives, or lived, in the local graph: a loop
    bool failed = false;
    bool fresh = false;  // while it is offered
    bool warned_qos = false;
  };
  struct Channel {
    TopicKey key;
    std::string type_hash;
    std::string action_type;
    Decision decision;
    bool newest_only = false;
    bool demanded = false;
    bool declined = false;
    bool limited = false;                 // some origins have no mirror, for want of room
    std::map<OriginId, Mirror*> origins;  // valid: a mirror lives while it has a candidate
    std::deque<InMessage> decoding;       // in order; the first is with a worker while `job` is set
    JobId job;
    std::uint64_t published = 0;
    std::uint64_t bytes = 0;
    std::uint64_t wire_bytes = 0;
    DropCounts dropped;
    std::optional<double> latency_ms;
  };

  void end_channel(const ChannelKey& key, bool keep_candidates, const Now& now);
  void name_origin(Mirror& mirror, const std::string& node, const Now& now);
  void add_origin(const ChannelKey& key, Channel& channel, const OriginOffer& origin,
                  const Now& now);
  void remove_candidate(Mirror& mirror, LinkId link, const Now& now);
  // Removes the link's candidates: all, or those it has not offered again.
  void remove_candidates(LinkId link, bool only_orphans, const Now& now);
  // `feeder_gone`: the candidate that was the first one has just been removed.
  void update_mirror(Mirror& mirror, const Now& now, bool feeder_gone = false);
  [[nodiscard]] bool is_of_this_graph(LinkId link) const;
  void create(Mirror& mirror, const Now& now);
  void destroy(Mirror& mirror);
  // `name` is that on the wire.
  [[nodiscard]] std::optional<Decision> permission(const Link& link, const std::string& name,
                                                   const std::string& type,
                                                   const std::string& action_type) const;
  [[nodiscard]] std::optional<Decision> permission(const Link& link, const TopicKey& key,
                                                   const std::string& action_type) const;
  // Whether this origin of /parameter_events is a node whose parameters no rule opens.
  [[nodiscard]] bool is_withheld(const Link& link, const Channel& channel,
                                 const OriginOffer& origin) const;
  void end_withheld(const Link& link, Channel& channel, const Now& now);
  // Demands the channel anew, so that the exporter sends the last samples again.
  void demand_again(const ChannelKey& key, Channel& channel, const Now& now);
  void renew(const ChannelKey& key, Channel& channel, const Now& now);
  void update_demands(const Mirror& mirror, const Now& now);
  void update_demand(const ChannelKey& key, const Now& now);
  [[nodiscard]] bool wanted(const ChannelKey& key, const Channel& channel, const Now& now) const;
  void decline(Link& link, ChannelId id, const std::string& code, const std::string& reason);
  void warn_incompatible(Mirror& mirror);
  [[nodiscard]] Qos mirror_qos(const Channel& channel, const OriginOffer& origin) const;

  Result<Nothing> decode(Link& link, const ChannelKey& key, Channel& channel, InMessage message,
                         const Now& now);
  void count_decoding(LinkId link, const InMessage& message, bool add);
  void tell_once(LogLevel level, const std::string& text);
  void start_job(const ChannelKey& key, Channel& channel);
  // Handles what waited behind a finished job, up to the next job.
  void advance(const ChannelKey& key, Channel& channel, const Now& now);
  void publish(Link& link, Channel& channel, const InMessage& message, const Payload& raw,
               const Now& now);

  const SideOptions& options_;
  const Policy& policy_;
  const GraphView& graph_;
  const Claims& claims_;
  LinkTable& links_;
  Outputs& outputs_;
  std::map<ChannelKey, Channel> channels_;
  std::map<MirrorKey, Mirror> mirrors_;
  std::unordered_map<JobId, ChannelKey> jobs_;
  std::uint64_t decoding_bytes_ = 0;
  std::map<LinkId, std::uint64_t> decoding_by_link_;  // the same for each, with its own bound
  std::set<std::string> told_;                        // failures that were logged
  // The first settles_at or ends_at; asked for after every input, changed seldom.
  mutable std::optional<TimePoint> deadline_;
  mutable bool deadline_known_ = false;
  std::map<LinkId, std::pair<Demand, Demand>> demands_;  // to be sent: on, off
  std::optional<TimePoint> graph_since_;  // no mirror before the first picture of the local graph
  bool claim_changed_ = true;             // the first claim is made even when it is empty
};

}  // namespace connect_bridge
