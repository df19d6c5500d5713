#include "core/topics/local_topics.hpp"

#include <cstddef>
#include <utility>

#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

// So many messages are handed over in the time of another entry.
constexpr std::size_t kKeptForEach = 64;

}  // namespace

void LocalTopics::on_graph(const Now& now) {
  for (const auto& [key, state] : context_.graph.topics())
    if (!state.publishers.empty()) topics_.try_emplace(key, context_, key);
  // A topic that exists for listeners alone may have to end for another type of its name.
  for (LocalTopic* topic : context_.names.standing()) topic->update_subscription(now);
  for (auto& [key, topic] : topics_) topic.on_graph(now);
  // Listeners come after the topics: a topic that is subscribed now for listeners gets the QoS that
  // its publishers need.
  context_.listeners.on_graph(now);
  update_listened(now);
}

void LocalTopics::review(const Link& link, const Now& now) {
  // Listeners first: the topics' subscriptions depend on the listeners that count and on their
  // rules.
  context_.listeners.review(link, now);
  update_listened(now);
  for (auto& [key, topic] : topics_) topic.review(link, now);
}

void LocalTopics::review(const Link& link, const std::string& name, const Now& now) {
  for (auto it = topics_.lower_bound({name, ""}); it != topics_.end() && it->first.first == name;
       ++it) {
    it->second.review(link, now);
    context_.news.insert(it->first);
  }
}

void LocalTopics::go_on(const Now& now) {
  context_.reviewing = false;
  for (const TopicKey& key : std::exchange(context_.postponed, {}))
    if (const auto topic = topics_.find(key); topic != topics_.end())
      topic->second.update_subscription(now);
}

namespace {

// A message about an origin of an offered topic takes as long as an offer, whose memory it touches
// and whose queue it sets up again. Each further origin, here and in an offer, takes a look.
void open_due(LocalTopic& topic, Link& link, Course& course, std::vector<ChannelOffer>& offers,
              const Now& now) {
  if (const std::size_t told = topic.tell_origins(link.id); told > 0)
    return course.charge(LinkOffer::kLooks + told - 1);
  if (!topic.is_due(link.id) || !link.may_offer()) return;
  course.charge(LinkOffer::kLooks + topic.origins().size() - 1);
  if (auto opened = topic.offer_to(link, now)) offers.push_back(*std::move(opened));
}

}  // namespace

bool LocalTopics::offer_all(Link& link, Course& course, std::vector<ChannelOffer>& offers,
                            const Now& now) {
  return course.each(topics_,
                     [&](LocalTopic& topic) { open_due(topic, link, course, offers, now); });
}

void LocalTopics::offer_one(const TopicKey& key, Link& link, Course& course,
                            std::vector<ChannelOffer>& offers, const Now& now) {
  const auto topic = topics_.find(key);
  if (topic != topics_.end()) open_due(topic->second, link, course, offers, now);
}

Result<Nothing> LocalTopics::on_listeners(Link& link, const Listeners& change, const Now& now) {
  const auto result = context_.listeners.on_listeners(link, change, now);
  update_listened(now);
  return result;
}

void LocalTopics::update_listened(const Now& now) {
  std::set<std::string> left;
  for (const TopicKey& key : context_.listeners.take_changes()) {
    // The last listener may have left: the topic is created then, too, and ends here unless
    // something else keeps it.
    const auto topic = topics_.try_emplace(key, context_, key).first;
    topic->second.on_listeners(now);
    if (topic->second.is_over()) left.insert(erase(topic));
  }
  update_subscriptions(left, now);
}

std::string LocalTopics::erase(std::map<TopicKey, LocalTopic>::iterator topic) {
  std::string name = topic->first.first;
  topics_.erase(topic);
  return name;
}

// Another type of a released name may be subscribed now. Each name is checked once: a peer may stop
// listening to a thousand types at once.
void LocalTopics::update_subscriptions(const std::set<std::string>& names, const Now& now) {
  for (const std::string& name : names) update_subscriptions(name, now);
}

void LocalTopics::update_subscriptions(const std::string& name, const Now& now) {
  for (auto it = topics_.lower_bound({name, ""}); it != topics_.end() && it->first.first == name;
       ++it)
    it->second.update_subscription(now);
}

void LocalTopics::end_listeners(LinkId link, const Now& now) {
  context_.listeners.on_link_lost(link);
  update_listened(now);
}

bool LocalTopics::on_link_lost(const Link& link, LinkEnd& end, const Now& now) {
  return end.each(topics_, [&](LocalTopic& topic) {
    if (link.life.may_return()) end.charge(topic.keep(link.id, now) / kKeptForEach);
    topic.on_link_lost(link.id, now);
  });
}

void LocalTopics::recheck_kept(const Link& link, const Now& now) {
  hold();  // the review of all links follows
  for (auto& [key, topic] : topics_)
    if (!topic.may_keep(link.id)) topic.end_kept(link.id, now);  // mutant: kept_right
}

void LocalTopics::end_kept(const Link& link, const Now& now) {
  for (auto& [key, topic] : topics_) topic.end_kept(link.id, now);
}

void LocalTopics::hold_action(const std::string& action, bool on, const Now& now) {
  for (const ActionPart part : {ActionPart::kFeedback, ActionPart::kStatus}) {
    const std::string name = name_of_part(action, part);
    if (on) {
      context_.held.insert(name);
    } else {
      context_.held.erase(name);
    }
    update_subscriptions(name, now);
  }
}

LocalTopic* LocalTopics::find(SubscriptionId subscription) const {
  const auto it = context_.by_subscription.find(subscription);
  return it == context_.by_subscription.end() ? nullptr : it->second;
}

// A subscription requests no more than the weakest publisher in the graph offers. For this
// publisher it is made again, unless the publisher is a bridge's.
void LocalTopics::on_incompatible(const QosIncompatible& found) const {
  context_.outputs.log_once(
      LogLevel::kDebug, found.topic + ": a publisher here offers an incompatible " + found.policy);
}

void LocalTopics::on_taken(MessageTaken taken, const Now& now) {
  if (auto* topic = find(taken.subscription)) topic->on_taken(std::move(taken), now);
}

void LocalTopics::on_lost(const MessagesLost& lost, const Now& now) {
  if (auto* topic = find(lost.subscription)) topic->on_lost(lost, now);
}

void LocalTopics::on_subscription_failed(const SubscriptionFailed& failed, const Now& now) {
  LocalTopic* const topic = find(failed.id);
  if (!topic) return;
  topic->on_subscription_failed(failed.code, failed.reason);
  update_subscriptions(topic->key().first, now);  // another type may have the name now
}

void LocalTopics::on_time(const Now& now) {
  context_.dropped.free_some();
  context_.listeners.on_time(now);
  update_listened(now);
  // Names of topics that are over. Other types of these names are checked after the loop, as it
  // erases topics.
  std::set<std::string> left;
  // The topics of a node that has ended are due together, and each ends on all its links.
  Course course{.left = context_.graph_options.offer_ends_at_once};
  for (std::size_t held = kHeldPerStep; held > 0 && course.take();) {
    const auto due = context_.timers.take_due(now.steady);
    if (!due) break;
    LocalTopic& topic = **due;
    course.charge(topic.offers());
    topic.on_time(held, now);
    if (topic.is_over()) left.insert(erase(topics_.find(topic.key())));
  }
  update_subscriptions(left, now);
}

std::vector<TopicOffer*> LocalTopics::steered() {
  std::vector<TopicOffer*> offers;
  for (auto& [key, topic] : topics_) topic.add_steered(offers);
  return offers;
}

void LocalTopics::add_status(const Link& link, LinkStatus& status) const {
  for (const auto& [key, topic] : topics_) topic.add_status(link.id, status);
}

void LocalTopics::add_channels(const Link& link, std::vector<ChannelFacts>& channels) const {
  for (const auto& [key, topic] : topics_) topic.add_channels(link.id, channels);
}

void LocalTopics::add_kept(const Link& link, LinkStatus& status) const {
  if (!keeps(link.id)) return;
  for (const auto& [key, topic] : topics_) topic.add_kept(link.id, status);
}

std::uint64_t LocalTopics::memory_bytes() const {
  std::uint64_t bytes = context_.parked.used() + context_.early.used();
  for (const auto& [link, kept] : context_.kept) bytes += kept.bytes();
  for (const auto& [key, topic] : topics_) bytes += topic.memory_bytes();
  return bytes;
}

}  // namespace connect_bridge
