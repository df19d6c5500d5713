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
  if (is_new) of_link.told = link.account->told_listeners.hold(0);
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
  for (const auto& told : change.added) {
    if (listeners.contains(told.listener))
      return Error{CloseCode::kIllegal, "the number of a listener is in use"};
    add(of_link, told);
  }
  of_link.told.resize(listeners.size());
  serve(of_link, now);
  return Nothing{};
}

// Parts of actions have no topic here, nor have names that are not ours. Another name may be mapped
// to the same topic, and the claims topic is not for peers.
void PeerListeners::add(OfLink& of_link, const ListenerTold& listener) {
  auto& topic = of_link.listeners[listener.listener];
  // Links of one identity could tell of as many as they have times the limit of one.
  const Account& account = *of_link.link->account;
  const std::uint64_t others = account.told_listeners.used() - of_link.told.amount();
  if (others + of_link.listeners.size() > Account::kListenersMax)
    return side_.outputs.log_once(
        of_link.link->account->told, LogLevel::kWarn,
        "not all that " + of_link.link->owner() + " listens to counts here: at most " +
            std::to_string(Account::kListenersMax) + " listeners for one identity");
  const NameMap& names = of_link.link->names;
  const std::string local = names.to_local(listener.name);
  if (names.to_wire(local) != listener.name || local == kClaimsTopic ||
      has_action_token(listener.name))
    return;
  topic = TopicKey{local, listener.type};
  const auto [told, is_new] = of_link.topics.try_emplace(*topic);
  ++told->second.listeners;
  if (!is_new) return;
  told->second.type_hash = listener.type_hash;
  decide(of_link, *topic, told->second);
}

void PeerListeners::remove(OfLink& of_link,
                           std::map<ListenerId, std::optional<TopicKey>>::iterator listener) {
  const auto topic = std::move(listener->second);
  of_link.listeners.erase(listener);
  if (!topic) return;
  const auto told = of_link.topics.find(*topic);
  if (--told->second.listeners > 0) return;
  leave(of_link, *topic, told->second);
  of_link.topics.erase(told);
}

// Both sides' rules for an exported topic decide (docs/protocol.md, "listeners", rule 2).
void PeerListeners::decide(const OfLink& of_link, const TopicKey& key, Told& told) {
  const Link& link = *of_link.link;
  const std::string name = link.names.wire_name(key.first);
  const auto right = export_right(side_, link, Interface{InterfaceKind::kTopic, name, key.second});
  if (right.answer != ExportRight::Answer::kYes) return leave(of_link, key, told);
  const QosOverride before = std::exchange(told.rule, right.decision.treatment.qos);
  if (!told.topic) return join(of_link, key, told);
  if (!(told.rule == before)) changed_.insert(key);  // the subscription gets another QoS (rules_of)
}

void PeerListeners::review(const Link& link, const Now& now) {
  const auto at = links_.find(link.id);
  if (at == links_.end()) return;
  for (auto& [key, told] : at->second.topics) decide(at->second, key, told);
  serve(at->second, now);
}

void PeerListeners::on_link_lost(LinkId link) {
  const auto at = links_.find(link);
  if (at == links_.end()) return;
  for (auto& [key, told] : at->second.topics) leave(at->second, key, told);
  links_.erase(at);
}

// ---- which topics count

void PeerListeners::join(const OfLink& of_link, const TopicKey& key, Told& told) {
  told.topic = &topics_[key];
  told.topic->links[of_link.link->id] = &told;
  if (told.topic->counts) {
    changed_.insert(key);
  } else {
    review(key, *told.topic);
  }
}

void PeerListeners::leave(const OfLink& of_link, const TopicKey& key, Told& told) {
  Topic* const topic = std::exchange(told.topic, nullptr);
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
  // As many steps as this graph has topics: the peers may have told many more. Published topics
  // give their places back before other topics take them.
  for (const auto& [key, state] : side_.graph.topics()) {
    if (state.publishers.empty()) continue;
    const auto told = topics_.find(key);
    if (told != topics_.end() && !told->second.is_free()) review(key, told->second);
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
    return std::find_if(of_link.topics.begin(), of_link.topics.end(), [](const auto& told) {
      return told.second.topic && !told.second.topic->counts;
    });
  };
  for (auto next = next_waiting(); next != of_link.topics.end(); next = next_waiting()) {
    const Outputs::Paying paying(side_.outputs, account.time);
    // When a place becomes free, give_back() makes the loop look here again.
    if (!has_place(account))
      return side_.outputs.log_once(account.told, LogLevel::kWarn,
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

std::vector<TopicKey> PeerListeners::told_by(LinkId link) const {
  std::vector<TopicKey> keys;
  if (const auto at = links_.find(link); at != links_.end())
    for (const auto& [key, told] : at->second.topics) keys.push_back(key);
  return keys;
}

std::vector<LinkId> PeerListeners::links_of(const TopicKey& topic) const {
  std::vector<LinkId> links;
  if (const Topic* const known = counting(topic))
    for (const auto& [link, told] : known->links) links.push_back(link);
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
  for (const auto& [link, told] : known->links) {
    if (!count(link)) continue;
    if (told->rule.reliability == Reliability::kBestEffort)
      weakest.reliability = told->rule.reliability;
    if (told->rule.durability == Durability::kVolatile) weakest.durability = told->rule.durability;
    if (told->rule.depth) weakest.depth = std::max(weakest.depth.value_or(0), *told->rule.depth);
  }
  return weakest;
}

TellOnce& PeerListeners::told_of(const TopicKey& topic) const {
  const Topic* const known = counting(topic);
  return known ? links_.at(known->links.begin()->first).link->account->told : side_.outputs.told();
}

}  // namespace connect_bridge
