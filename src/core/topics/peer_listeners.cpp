#include "core/topics/peer_listeners.hpp"

#include <algorithm>
#include <cstdint>

#include "core/offers/export_right.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

bool is_published(const SideView& side, const TopicKey& key) {
  const TopicState* const state = side.graph.find(key);
  return state && !state->publishers.empty();
}

bool has_place(const Account& account) {
  return account.listened.used() < PeerListeners::kUnpublishedMax && account.listened.room() > 0;
}

}  // namespace

// ---- reports of the peers

Result<Nothing> PeerListeners::on_listeners(Link& link, const Listeners& change, const Now& now) {
  const auto [at, is_new] = links_.try_emplace(link.id, *this, link);
  OfLink& of_link = at->second;
  if (is_new) of_link.held = link.account->reported_listeners.hold(0);
  auto& listeners = of_link.listeners;
  // Removals come first (docs/protocol.md, "listeners"), so a peer at its limit can replace all in
  // one message. Each removal may end a subscription here, so a peer must not repeat them without
  // limit.
  for (const ListenerId gone : change.removed) {
    const auto it = listeners.find(gone);
    if (it == listeners.end()) continue;
    remove(of_link, it);
    if (!link.note_withdrawal(now))
      return Error{CloseCode::kTooLarge, "listeners come and go too often"};
  }
  if (listeners.size() + change.added.size() > kListenersMax)
    return Error{CloseCode::kTooLarge, "more listeners than this side accepts"};
  for (const auto& reported : change.added) {
    if (listeners.contains(reported.listener))
      return Error{CloseCode::kIllegal, "the number of a listener is in use"};
    add(of_link, reported);
  }
  of_link.held.resize(listeners.size());
  serve(of_link, now);
  return Nothing{};
}

// Parts of actions have no topic here, nor have names that are not ours. Another name may be mapped
// to the same topic, and the claims topic is not for peers.
void PeerListeners::add(OfLink& of_link, const ListenerReport& listener) {
  auto& topic = of_link.listeners[listener.listener];
  // Links of one identity could tell of as many as they have times the limit of one.
  const Account& account = *of_link.link->account;
  const std::uint64_t others = account.reported_listeners.used() - of_link.held.amount();
  if (others + of_link.listeners.size() > Account::kListenersMax)
    return side_.outputs.log_once(
        of_link.link->account->logged, LogLevel::kWarn,
        "not all that " + of_link.link->owner() + " listens to counts here: at most " +
            std::to_string(Account::kListenersMax) + " listeners for one identity");
  const NameMap& names = of_link.link->names;
  const std::string local = names.to_local(listener.name);
  if (names.to_wire(local) != listener.name || local == kClaimsTopic ||
      has_action_token(listener.name))
    return;
  topic = TopicKey{local, listener.type};
  const auto [reported, is_new] = of_link.topics.try_emplace(*topic);
  ++reported->second.listeners;
  if (!is_new) return;
  reported->second.type_hash = listener.type_hash;
  decide(of_link, *topic, reported->second);
}

void PeerListeners::remove(OfLink& of_link,
                           std::map<ListenerId, std::optional<TopicKey>>::iterator listener) {
  const auto topic = std::move(listener->second);
  of_link.listeners.erase(listener);
  if (!topic) return;
  const auto reported = of_link.topics.find(*topic);
  if (--reported->second.listeners > 0) return;
  leave(of_link, *topic, reported->second);
  of_link.topics.erase(reported);
}

// Both sides' rules for an exported topic decide (docs/protocol.md, "listeners", rule 2).
void PeerListeners::decide(const OfLink& of_link, const TopicKey& key, Reported& reported) {
  const Link& link = *of_link.link;
  const std::string name = link.names.wire_name(key.first);
  const auto right = export_right(side_, link, Interface{InterfaceKind::kTopic, name, key.second});
  if (right.answer != ExportRight::Answer::kYes) return leave(of_link, key, reported);
  const QosOverride before = std::exchange(reported.rule, right.decision.treatment.qos);
  if (!reported.topic) return join(of_link, key, reported);
  if (!(reported.rule == before))
    changed_.insert(key);  // the subscription gets another QoS (rules_of)
}

void PeerListeners::review(const Link& link, const Now& now) {
  const auto at = links_.find(link.id);
  if (at == links_.end()) return;
  for (auto& [key, reported] : at->second.topics) decide(at->second, key, reported);
  serve(at->second, now);
}

void PeerListeners::on_link_lost(LinkId link) {
  const auto at = links_.find(link);
  if (at == links_.end()) return;
  for (auto& [key, reported] : at->second.topics) leave(at->second, key, reported);
  links_.erase(at);
}

// ---- which topics count

void PeerListeners::join(const OfLink& of_link, const TopicKey& key, Reported& reported) {
  reported.topic = &topics_[key];
  reported.topic->links[of_link.link->id] = &reported;
  if (reported.topic->counts) {
    changed_.insert(key);
  } else {
    review(key, *reported.topic);
  }
}

void PeerListeners::leave(const OfLink& of_link, const TopicKey& key, Reported& reported) {
  Topic* const topic = std::exchange(reported.topic, nullptr);
  if (!topic) return;
  topic->links.erase(of_link.link->id);
  if (topic->counts) changed_.insert(key);
  review(key, *topic);
  if (topic->links.empty()) topics_.erase(key);
}

void PeerListeners::review(const TopicKey& key, Topic& topic) {
  const bool published = !topic.links.empty() && is_published(side_, key);
  if (published || !topic.links.contains(topic.payer)) give_back(topic);
  // The publishers are gone, or the link that paid for the place: the topic stays if another link
  // has room.
  if (topic.counts && !published)
    for (auto it = topic.links.begin(); it != topic.links.end() && !topic.payer; ++it)
      take_place(topic, *links_.at(it->first).link);
  count(key, topic, published || topic.payer);
  if (topic.is_free()) {
    free_.insert(key);
  } else {
    free_.erase(key);
  }
}

void PeerListeners::take_place(Topic& topic, const Link& payer) {
  if (!has_place(*payer.account)) return;
  topic.place = payer.account->listened.hold(1);
  topic.payer = payer.id;
}

void PeerListeners::give_back(Topic& topic) {
  if (!topic.payer) return;
  topic.payer = {};
  topic.place.release();
  const bool awaited = std::any_of(topics_.begin(), topics_.end(),
                                   [](const auto& other) { return !other.second.counts; });
  if (awaited) due_ = TimePoint{};
}

void PeerListeners::count(const TopicKey& key, Topic& topic, bool counts) {
  if (std::exchange(topic.counts, counts) != counts) changed_.insert(key);
}

void PeerListeners::on_graph(const Now& now) {
  // The topics of this graph are the steps here: the peers may have reported many more. Published
  // topics give their places back before other topics take them.
  for (const auto& [key, state] : side_.graph.topics()) {
    if (state.publishers.empty()) continue;
    const auto reported = topics_.find(key);
    if (reported != topics_.end() && !reported->second.is_free()) review(key, reported->second);
  }
  const std::vector<TopicKey> published(free_.begin(), free_.end());
  for (const TopicKey& key : published)
    if (!is_published(side_, key)) review(key, topics_.at(key));
  on_time(now);
}

void PeerListeners::on_time(const Now& now) {
  if (!due_ || *due_ > now.steady) return;
  due_.reset();
  for (auto& [link, of_link] : links_) serve(of_link, now);
}

// Each subscription that comes or goes costs every process of the graph, and this one's loop.
void PeerListeners::serve(OfLink& of_link, const Now& now) {
  Account& account = *of_link.link->account;
  const auto next_waiting = [&] {
    return std::find_if(of_link.topics.begin(), of_link.topics.end(), [](const auto& reported) {
      return reported.second.topic && !reported.second.topic->counts;
    });
  };
  for (auto next = next_waiting(); next != of_link.topics.end(); next = next_waiting()) {
    const Outputs::Paying paying(side_.outputs, account.time);
    // When a place becomes free, give_back() makes the loop look here again.
    if (!has_place(account))
      return side_.outputs.log_once(account.logged, LogLevel::kWarn,
                                    "not all that " + of_link.link->owner() +
                                        " subscribes to is subscribed here: of topics "
                                        "that nobody publishes at most " +
                                        std::to_string(kUnpublishedMax) +
                                        " topics for one identity, and " +
                                        std::to_string(Shares::kListenedMax) + " for all");
    if (account.listeners.ask(of_link, now.steady) != Appearing::Answer::kNow) return;
    take_place(*next->second.topic, *of_link.link);
    count(next->first, *next->second.topic, true);
  }
}

// ---- what the listeners result in

const PeerListeners::Topic* PeerListeners::counting(const TopicKey& topic) const {
  const auto known = topics_.find(topic);
  return known != topics_.end() && known->second.counts ? &known->second : nullptr;
}

std::vector<TopicKey> PeerListeners::reported_by(LinkId link) const {
  std::vector<TopicKey> keys;
  if (const auto at = links_.find(link); at != links_.end())
    for (const auto& [key, reported] : at->second.topics) keys.push_back(key);
  return keys;
}

std::vector<LinkId> PeerListeners::links_of(const TopicKey& topic) const {
  std::vector<LinkId> links;
  if (const Topic* const known = counting(topic))
    for (const auto& [link, reported] : known->links) links.push_back(link);
  return links;
}

std::string PeerListeners::type_hash_of(const TopicKey& topic) const {
  const Topic* const known = counting(topic);
  return known ? known->links.begin()->second->type_hash : "";
}

QosOverride PeerListeners::rules_of(const TopicKey& topic,
                                    const std::function<bool(LinkId)>& count) const {
  QosOverride weakest;
  const Topic* const known = counting(topic);
  if (!known) return weakest;
  for (const auto& [link, reported] : known->links) {
    if (!count(link)) continue;
    if (reported->rule.reliability == Reliability::kBestEffort)
      weakest.reliability = reported->rule.reliability;
    if (reported->rule.durability == Durability::kVolatile)
      weakest.durability = reported->rule.durability;
    if (reported->rule.depth)
      weakest.depth = std::max(weakest.depth.value_or(0), *reported->rule.depth);
  }
  return weakest;
}

LoggedOnce& PeerListeners::logged_of(const TopicKey& topic) const {
  const Topic* const known = counting(topic);
  return known ? links_.at(known->links.begin()->first).link->account->logged
               : side_.outputs.logged();
}

}  // namespace connect_bridge
