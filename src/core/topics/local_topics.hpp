// The topics of the local graph that may be exported.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/course.hpp"
#include "core/topics/export_context.hpp"
#include "core/topics/local_topic.hpp"

namespace connect_bridge {

// Finds or creates the topic that an input concerns. Single-threaded; owned by the side.
class LocalTopics {
 public:
  LocalTopics(const SideView& side, const TopicOptions& options, Budget* memory)
      : context_{side, options, Budget(memory)} {}

  void on_graph(const Now& now);
  // The peer's `accepts` or our rules have changed. Withdraws topics that are no longer allowed, or
  // that are treated differently now; the latter may be offered again.
  void review(const Link& link, const Now& now);
  // The same for the topics of one name.
  void review(const Link& link, const std::string& name, const Now& now);
  // Between hold() and go_on() subscriptions end, but none is made: rights are under review.
  void hold() { context_.reviewing = true; }
  void go_on(const Now& now);
  // Opens the topics that are due for the link, as far as `course` allows, and adds their offers;
  // tells of new origins of those that are open. True: none is left. offer_one(): the same for this
  // one.
  [[nodiscard]] bool offer_all(Link& link, Course& course, std::vector<ChannelOffer>& offers,
                               const Now& now);
  void offer_one(const TopicKey& key, Link& link, Course& course, std::vector<ChannelOffer>& offers,
                 const Now& now);
  // The topics that may have become due since the last call.
  std::set<TopicKey> take_news() { return std::exchange(context_.news, {}); }
  // The connection is about to be lost. Its listeners leave first, so that no topic is subscribed
  // again for one that leaves with the same link. Then the offers end, some in each step; messages
  // are kept for another connection that may follow. True: all have ended.
  void end_listeners(LinkId link, const Now& now);
  [[nodiscard]] bool on_link_lost(const Link& link, LinkEnd& end, const Now& now);
  // Rules or the identity of a lost link have changed: drops backlogs that the rules forbid or
  // treat differently now.
  void recheck_kept(const Link& link, const Now& now);
  // The link will not return: nothing is kept for it any more.
  void end_kept(const Link& link, const Now& now);
  [[nodiscard]] bool keeps(LinkId link) const { return context_.kept.contains(link); }
  // Nodes of the peer's graph that subscribe to topics we may export. An error closes the
  // connection.
  Result<Nothing> on_listeners(Link& link, const Listeners& change, const Now& now);

  // Keeps the feedback and status of this action subscribed, even without demand, while a peer can
  // send goals to it. A new subscription would miss the messages right after a goal.
  void hold_action(const std::string& action, bool on, const Now& now);

  // The offers by which robots are driven from here, of all links.
  [[nodiscard]] std::vector<TopicOffer*> steered();

  void on_taken(MessageTaken taken, const Now& now);
  void on_lost(const MessagesLost& lost, const Now& now);
  void on_subscription_failed(const SubscriptionFailed& failed, const Now& now);
  void on_time(const Now& now);

  // A publisher here does not serve our subscription as it is.
  void on_incompatible(const QosIncompatible& found) const;

  [[nodiscard]] std::optional<TimePoint> deadline() const {
    return earliest(context_.dropped.deadline(),
                    earliest(context_.timers.deadline(), context_.listeners.deadline()));
  }
  void add_status(const Link& link, LinkStatus& status) const;
  void add_channels(const Link& link, std::vector<ChannelFacts>& channels) const;
  // What the peer listens to, whether our rules allow it or not; local names.
  [[nodiscard]] std::vector<TopicKey> listened_by(const Link& link) const {
    return context_.listeners.reported_by(link.id);
  }
  // Adds the backlogs of a lost link to its status.
  void add_kept(const Link& link, LinkStatus& status) const;
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  void update_listened(const Now& now);
  // Erases the topic. Returns its name, for update_subscriptions().
  std::string erase(std::map<TopicKey, LocalTopic>::iterator topic);
  // Updates the subscriptions of these names, with all their types.
  void update_subscriptions(const std::set<std::string>& names, const Now& now);
  void update_subscriptions(const std::string& name, const Now& now);
  // Null: the subscription has ended.
  [[nodiscard]] LocalTopic* find(SubscriptionId subscription) const;

  ExportContext context_;
  std::map<TopicKey, LocalTopic> topics_;
};

}  // namespace connect_bridge
