// The topics of the local graph that links may have: what is offered to whom, who demands it, and
// the way of a sample from its subscription into the links' outboxes.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "core/flow/history.hpp"
#include "core/flow/rate_limit.hpp"
#include "core/graph/actions.hpp"
#include "core/graph/graph_view.hpp"
#include "core/jobs/encoder.hpp"
#include "core/link/link.hpp"
#include "core/ports/outputs.hpp"
#include "core/ports/status.hpp"

namespace connect_bridge {

struct SideOptions;

// A topic is exported while it has a real publisher (an origin). Per topic there is at most one
// subscription, held while any link demands the topic. Single-threaded; owned by the side.
class Exports {
 public:
  Exports(const SideOptions& options, const Policy& policy, const LocalActions& actions,
          LinkTable& links, Jobs& jobs, Outputs& outputs);
  ~Exports();

  void on_graph(const GraphView& graph, const Now& now);
  // The peer's Accepts or our rules are new: withdraws what is no longer allowed, or is treated
  // differently now; it may be offered anew.
  void recheck(Link& link, const Now& now);
  // Adds what is to be offered to the link and is not yet.
  void collect_offers(Link& link, std::vector<ChannelOffer>& offers);
  [[nodiscard]] bool is_offered(LinkId link, ChannelId channel) const {
    return by_channel_.contains({link, channel});
  }
  void on_link_lost(LinkId link);
  Result<Nothing> on_demand(Link& link, const Demand& demand, const Now& now);
  void on_decline(Link& link, const Decline& decline, const Now& now);

  // While a peer can send goals to this action, its feedback and status are subscribed, demanded or
  // not: what follows a goal at once would be over before a new subscription had been matched.
  void hold_action(const std::string& action, bool on, const Now& now);

  void on_taken(MessageTaken taken, const Now& now);
  void on_lost(const MessagesLost& lost);
  void on_subscription_failed(const SubscriptionFailed& failed);
  void on_time(const Now& now);

  [[nodiscard]] std::optional<TimePoint> deadline() const;
  void add_status(const Link& link, LinkStatus& status) const;
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  struct Origin {
    OriginId id;
    std::string node;
    Qos qos;
    Stamp last_stamp = 0;                  // transient local: the newest sample that was forwarded
    std::optional<TimePoint> vanishes_at;  // its publisher left the graph
    bool lingering = false;                // and its samples still wait in a queue
    bool seen = false;                     // while a graph is compared
  };
  // The topic on one link.
  struct Export {
    ChannelId channel;  // none: not allowed, or not accepted by the peer
    Decision decision;
    bool demanded = false;
    RateLimit rate;
    std::uint64_t raw_bytes = 0;
    DropCounts dropped;           // before the outbox
    std::set<OriginId> withheld;  // of /parameter_events: the nodes that no rule opens
    std::string declined;
  };
  struct Parked {
    MessageTaken taken;
    TimePoint until;
  };
  struct Topic;
  // What compresses a topic in one way.
  struct Stream final : JobOwner {
    Stream(Exports& of, Topic& its, Encoder::Options options)
        : exports(of), topic(its), encoder(options, of.jobs_, *this) {}
    void on_job(std::optional<Payload> result, const Now& now) override {
      encoder.finish(std::move(result));
      exports.send_encoded(topic, encoder, now);
    }

    Exports& exports;
    Topic& topic;
    Encoder encoder;
  };
  struct Topic {
    TopicKey key;
    std::string type_hash;
    std::map<Gid, Origin> origins;  // in an order that every library shares
    std::uint32_t last_origin = 0;
    int vanishing = 0;  // origins with vanishes_at
    std::map<LinkId, Export> links;
    SubscriptionId subscription;  // none: nobody demands it
    bool failed = false;  // the subscription could not be created; tried again when origins change
    Qos subscription_qos;
    TimePoint paid_until{};                  // every subscription that was made counts for a period
    std::optional<TimePoint> subscribes_at;  // demanded, but too many were made before
    HistoryCache history;
    std::map<Compression, Stream> encoders;
    std::deque<Parked> parked;  // samples of publishers the graph has not told of yet
    bool warned_mixed = false;
    bool warned_large = false;
  };
  using Topics = std::map<TopicKey, Topic>;

  void update_origins(Topic& topic, const TopicState* state, const Now& now);
  void count_vanishing(Topic& topic, int change);
  void remove_vanished(Topic& topic, const Now& now);
  [[nodiscard]] bool drained(const Topic& topic) const;
  std::optional<ChannelOffer> try_offer(Topic& topic, Link& link);
  [[nodiscard]] std::optional<Decision> permission(const Link& link, const TopicKey& key) const;
  [[nodiscard]] bool is_withheld(const Link& link, const TopicKey& key, const Origin& origin) const;
  // The node's name as the peer knows it; one outside our prefix has but this.
  [[nodiscard]] std::string wire_node(const Origin& origin) const;
  [[nodiscard]] std::set<OriginId> withheld(const Link& link, const Topic& topic) const;
  void withdraw(Topic& topic, Link& link);
  [[nodiscard]] ChannelOffer describe(const Topic& topic, const Export& exported) const;
  [[nodiscard]] QueueOptions queue_options(const Topic& topic, const Export& exported) const;

  void update_subscription(Topic& topic, const Now& now);
  [[nodiscard]] bool may_subscribe(Topic& topic, const Now& now);
  void unsubscribe(Topic& topic);
  [[nodiscard]] Qos wanted_qos(const Topic& topic) const;
  [[nodiscard]] std::uint32_t history_depth(const Topic& topic) const;
  void warn_mixed(Topic& topic);

  void forward(Topic& topic, Origin& origin, MessageTaken taken, const Now& now);
  bool admit(Export& exported, const Link& link, std::size_t bytes, const Now& now);
  void encode(Topic& topic, const Compression& how, OutSample sample, const Now& now);
  void send_encoded(Topic& topic, Encoder& encoder, const Now& now);
  void deliver(Topic& topic, LinkId link, const OutSample& sample, Codec codec, const Payload& body,
               const Now& now);
  void send_history(Topic& topic, Export& exported, Link& link, const Now& now);
  void unpark(Topic& topic, const Now& now);
  void drop(Topic& topic, const OutSample& sample, DropReason reason);
  Encoder& encoder(Topic& topic, const Compression& how);
  Topic* topic_of(LinkId link, ChannelId channel);

  const SideOptions& options_;
  const Policy& policy_;
  const LocalActions& actions_;
  LinkTable& links_;
  Jobs& jobs_;
  Outputs& outputs_;
  Topics topics_;
  std::unordered_map<SubscriptionId, Topic*> by_subscription_;
  std::map<std::pair<LinkId, ChannelId>, Topic*> by_channel_;
  std::set<std::string> held_;                 // topics that are subscribed without demand
  std::unordered_set<Gid> bridge_publishers_;  // of other bridges: never origins
  std::uint64_t parked_bytes_ = 0;
  std::size_t parked_samples_ = 0;
  int late_subscriptions_ = 0;  // topics with subscribes_at
  int vanishing_ = 0;           // origins with vanishes_at, of all topics
};

}  // namespace connect_bridge
