// One topic of the local graph that may be exported.
// One unit: publishers, subscription, history and offers of a topic begin and end each other.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/flow/history.hpp"
#include "core/topics/backlogs.hpp"
#include "core/topics/export_context.hpp"
#include "core/topics/parked_samples.hpp"
#include "core/topics/recent_loss.hpp"
#include "core/topics/subscription_turn.hpp"
#include "core/topics/topic_offers.hpp"

namespace connect_bridge {

// The topic exists while it has a real publisher (an origin) or a listener of a peer. It also
// exists while something is kept or counted for a lost link. It has at most one subscription: while
// a link demands it, a peer subscribes, or something holds it. Each sample is attributed to its
// origin and sent to the links whose offers admit it. Single-threaded.
class LocalTopic {
 public:
  LocalTopic(ExportContext& context, TopicKey key);
  LocalTopic(const LocalTopic&) = delete;
  LocalTopic& operator=(const LocalTopic&) = delete;

  void on_graph(const Now& now);
  // Was nothing decided for the link?
  [[nodiscard]] bool is_due(LinkId link) const {
    return !origins_.empty() && !offers_.contains(link);
  }
  // The offer for the link; nullopt: none, or it was decided before.
  [[nodiscard]] std::optional<ChannelOffer> offer_to(Link& link, const Now& now);
  // Tells the link of the origins that it does not know yet. Returns their number.
  std::size_t tell_origins(LinkId link);
  // Rules, the peer's `accepts`, or the type's definition have changed: an offer that would differ
  // now ends.
  void review(const Link& link, const Now& now);
  // The connection is about to be lost: keeps messages that may not have arrived, and all that are
  // published until the link returns. Returns how many are kept so far.
  std::size_t keep(LinkId link, const Now& now);
  // The topic's offer on this link has ended with the connection.
  void on_link_lost(LinkId link, const Now& now);
  // The link will not return, or its peer has lost its state: its backlog is dropped.
  void end_kept(LinkId link, const Now& now);
  // The demand of this offer to this link has changed.
  void on_demand(TopicOffer& offer, LinkId link, const ChannelDemand& demand, const Now& now);
  void on_decline(TopicOffer& offer, const Now& now);
  // Listeners came or went.
  void on_listeners(const Now& now);
  // No publisher is here, no listener at the other side, and nothing is kept for a lost link.
  [[nodiscard]] bool is_over() const;
  // The demand or the publishers have changed: creates the subscription that fits, or ends it.
  void update_subscription(const Now& now);

  void on_taken(MessageTaken taken, const Now& now);
  void on_lost(const MessagesLost& lost, const Now& now);
  // Withdraws the topic until its publishers change, or a later link demands it.
  void on_subscription_failed(const std::string& code, const std::string& reason);
  // See TopicOffers.
  void on_time(std::size_t& held, const Now& now);

  [[nodiscard]] const TopicKey& key() const { return what_->key; }
  [[nodiscard]] const std::shared_ptr<const LocalInterface>& what() const { return what_; }
  [[nodiscard]] const std::string& type_hash() const { return type_hash_; }
  [[nodiscard]] const Origins& origins() const { return origins_; }
  [[nodiscard]] bool has_header() const { return has_header_; }
  [[nodiscard]] const RecentLoss& loss() const { return loss_; }
  // Number of samples of one origin that a late local subscriber would get, as far as the graph
  // shows.
  [[nodiscard]] std::uint32_t history_depth() const;
  // Number of links for which something was decided.
  [[nodiscard]] std::size_t offers() const { return offers_.size(); }
  // Adds the offers by which robots are driven from here.
  void add_steered(std::vector<TopicOffer*>& offers);
  void add_status(LinkId link, LinkStatus& status) const;
  void add_channels(LinkId link, std::vector<ChannelFacts>& channels) const;
  // What is kept for the link; and whether the rules here still allow that.
  void add_kept(LinkId link, LinkStatus& status) const { backlogs_.add_status(link, status); }
  [[nodiscard]] bool may_keep(LinkId link) const { return backlogs_.may_stay(link); }
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  void on_type_hash(const TopicState& state, const Now& now);
  // Links whose offers were withdrawn because the subscription had failed get new ones.
  void offer_closed_again();
  void remove_vanished(const Now& now);
  [[nodiscard]] bool drained() const;
  // Whether samples of the origin (or, since a link has returned, of the topic) wait for that link.
  [[nodiscard]] bool is_kept(OriginId origin) const;

  [[nodiscard]] bool is_wanted() const;
  [[nodiscard]] Qos wanted_qos() const;
  void take_name();
  void unsubscribe();
  void end_subscription();
  void forget_subscription();
  void warn_mixed();
  void log_once(const std::string& what);

  void park(MessageTaken taken, const Now& now);
  void unpark(const Now& now);
  // Fills in the facts that the sample's content shows.
  void read(OutSample& sample, TimePoint taken) const;
  // `at`: when the sample came; it may have waited for its publisher to be known.
  void forward(Origin& origin, MessageTaken taken, TimePoint at, const Now& now);
  // The link, whose peer listens, has the offer before its turn.
  void offer_at_once(Link& link, const Now& now);
  // A sample was taken: keeps it for the links that will demand the topic.
  void keep_early(const OutSample& sample, const Now& now);
  void send_history(TopicOffer& offer, const Now& now);

  ExportContext& context_;
  std::shared_ptr<const LocalInterface> what_;
  std::string type_hash_;
  bool lacks_type_ = false;
  bool has_header_ = false;  // the type begins with a header
  Origins origins_;
  TopicOffers offers_;
  Backlogs backlogs_;
  RecentLoss loss_;
  SubscriptionId subscription_;  // none: not subscribed
  Qos subscription_qos_;
  Stamp subscribed_at_ = 0;
  std::string subscription_hash_;
  bool failed_ = false;  // could not be subscribed, and nobody has demanded the topic since
  SubscriptionTurn turn_;
  ExportTimers::Timer late_;  // wanted, but too many subscriptions were made just before
  HistoryCache history_;
  ParkedSamples parked_;
};

}  // namespace connect_bridge
