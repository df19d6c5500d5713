#include "core/topics/far_listeners.hpp"

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
  return account.listened.used() < FarListeners::kUnpublishedMax && account.listened.room() > 0;
}

}  // namespace

// ---- what peers tell

Result<Nothing> FarListeners::on_listeners(Link& link, const Listeners& change, const Now& now) {
  OfLink& of_link = links_.try_emplace(link.id, *this, link).first->second;
  auto& listeners = of_link.listeners;
  // Those that go are first (docs/protocol.md, "listeners"), so a peer at its limit can replace all
  // in one message. Each may end a subscription here, so a peer must not do that without a pause.
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
  serve(of_link, now);
  return Nothing{};
}

// Parts of actions and what is not ours by its name have no topic: another name may be mapped to
// it, and the claims topic is not for peers.
void FarListeners::add(OfLink& of_link, const ListenerTold& listener) {
  auto& topic = of_link.listeners[listener.listener];
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
  decide(*of_link.link, *topic, told->second);
  if (told->second.permitted) join(of_link, *topic, told->second);
}

void FarListeners::remove(OfLink& of_link,
                          std::map<ListenerId, std::optional<TopicKey>>::iterator listener) {
  const auto topic = std::move(listener->second);
  of_link.listeners.erase(listener);
  if (!topic) return;
  const auto told = of_link.topics.find(*topic);
  if (--told->second.listeners > 0) return;
  if (told->second.permitted) leave(of_link, *topic);
  of_link.topics.erase(told);
}

// By both sides' rules for a topic that this side exports (docs/protocol.md, "listeners", rule 2).
void FarListeners::decide(const Link& link, const TopicKey& key, Told& told) const {
  told.permitted = false;
  if (!link.accepts) return;
  const std::string name = link.names.wire_name(key.first);
  const Interface what{InterfaceKind::kTopic, name, key.second};
  const auto right = export_right(side_, link, what);
  if (!right.is_allowed_here()) return;
  told.permitted = right.answer == ExportRight::Answer::kYes;
  told.rule = right.decision.treatment.qos;
}

void FarListeners::review(const Link& link, const Now& now) {
  const auto at = links_.find(link.id);
  if (at == links_.end()) return;
  OfLink& of_link = at->second;
  for (auto& [key, told] : of_link.topics) {
    const bool was_permitted = told.permitted;
    const QosOverride before = told.rule;
    decide(link, key, told);
    if (told.permitted && !was_permitted) join(of_link, key, told);
    if (!told.permitted && was_permitted) leave(of_link, key);
    // It may have to be subscribed in another way (rules_of).
    if (told.permitted && was_permitted && !(told.rule == before)) changed_.insert(key);
  }
  serve(of_link, now);
}

void FarListeners::on_link_lost(LinkId link) {
  const auto at = links_.find(link);
  if (at == links_.end()) return;
  for (const auto& [key, told] : at->second.topics)
    if (told.permitted) leave(at->second, key);
  links_.erase(at);
}

// ---- which of them count

void FarListeners::join(OfLink& of_link, const TopicKey& key, const Told& told) {
  Topic& topic = topics_[key];
  topic.links[of_link.link->id] = &told;
  if (topic.counts) {
    changed_.insert(key);
  } else {
    review(key, topic);
  }
}

void FarListeners::leave(OfLink& of_link, const TopicKey& key) {
  of_link.waiting.erase(key);
  const auto at = topics_.find(key);
  Topic& topic = at->second;
  topic.links.erase(of_link.link->id);
  if (topic.counts) changed_.insert(key);
  review(key, topic);
  if (topic.links.empty()) topics_.erase(at);
}

void FarListeners::review(const TopicKey& key, Topic& topic) {
  if (topic.links.empty()) return count(key, topic, false);
  if (is_published(side_, key)) {
    give_back(topic);
    return count(key, topic, true);
  }
  if (topic.counts && topic.links.contains(topic.payer)) return;
  if (topic.counts) {
    // Its publishers are gone, or those who had the place: it stays where another one has room.
    give_back(topic);
    for (const auto& [link, told] : topic.links)
      if (take_place(key, topic, links_.at(link))) return;
    count(key, topic, false);
  }
  for (const auto& [link, told] : topic.links) links_.at(link).waiting.insert(key);
}

bool FarListeners::take_place(const TopicKey& key, Topic& topic, const OfLink& payer) {
  Account& account = *payer.link->account;
  if (!has_place(account)) return false;
  topic.place = account.listened.hold(1);
  topic.payer = payer.link->id;
  count(key, topic, true);
  return true;
}

void FarListeners::give_back(Topic& topic) {
  topic.payer = {};
  if (topic.place.amount() == 0) return;
  topic.place.release();
  const bool awaited = std::any_of(links_.begin(), links_.end(),
                                   [](const auto& of) { return !of.second.waiting.empty(); });
  if (awaited) due_ = TimePoint{};
}

void FarListeners::count(const TopicKey& key, Topic& topic, bool counts) {
  if (counts) {
    for (const auto& [link, told] : topic.links) links_.at(link).waiting.erase(key);
  } else {
    give_back(topic);
  }
  if (std::exchange(topic.counts, counts) != counts) changed_.insert(key);
}

void FarListeners::on_graph(const Now& now) {
  // What is published gives its place back before another one takes it.
  for (const bool published : {true, false})
    for (auto& [key, topic] : topics_)
      if (is_published(side_, key) == published && topic.is_free() != published) review(key, topic);
  on_time(now);
}

void FarListeners::on_time(const Now& now) {
  if (!due_ || *due_ > now.steady) return;
  due_.reset();
  for (auto& [link, of_link] : links_) serve(of_link, now);
}

// A subscription that comes or goes costs every process of the graph, and this one's loop.
void FarListeners::serve(OfLink& of_link, const Now& now) {
  if (of_link.waiting.empty()) return;
  Account& account = *of_link.link->account;
  const Outputs::Paying paying(side_.outputs, account.time);
  while (!of_link.waiting.empty()) {
    // When one ends, give_back() looks here again.
    if (!has_place(account))
      return side_.outputs.log_once(account.told, LogLevel::kWarn,
                                    "not all that " + of_link.link->owner() +
                                        " listens to is subscribed here: of what nobody "
                                        "publishes at most " +
                                        std::to_string(kUnpublishedMax) +
                                        " topics for one identity, and " +
                                        std::to_string(Shares::kListenedMax) + " for all");
    if (account.listeners.ask(of_link, now.steady) != Appearing::Answer::kNow) return;
    const TopicKey key = *of_link.waiting.begin();
    static_cast<void>(take_place(key, topics_.at(key), of_link));
  }
}

// ---- what they come to

const FarListeners::Topic* FarListeners::counting(const TopicKey& topic) const {
  const auto known = topics_.find(topic);
  return known != topics_.end() && known->second.counts ? &known->second : nullptr;
}

std::vector<TopicKey> FarListeners::told_by(LinkId link) const {
  std::vector<TopicKey> keys;
  if (const auto at = links_.find(link); at != links_.end())
    for (const auto& [key, told] : at->second.topics) keys.push_back(key);
  return keys;
}

bool FarListeners::listens(const TopicKey& topic, LinkId link) const {
  const Topic* const known = counting(topic);
  return known && known->links.contains(link);
}

std::vector<LinkId> FarListeners::links_of(const TopicKey& topic) const {
  std::vector<LinkId> links;
  if (const Topic* const known = counting(topic))
    for (const auto& [link, told] : known->links) links.push_back(link);
  return links;
}

std::string FarListeners::type_hash_of(const TopicKey& topic) const {
  const Topic* const known = counting(topic);
  return known ? known->links.begin()->second->type_hash : "";
}

QosOverride FarListeners::rules_of(const TopicKey& topic,
                                   const std::function<bool(LinkId)>& count) const {
  QosOverride weakest;
  const Topic* const known = counting(topic);
  if (!known) return weakest;
  for (const auto& [link, told] : known->links) {
    if (!count(link)) continue;
    if (told->rule.reliability == Reliability::kBestEffort)
      weakest.reliability = told->rule.reliability;
    if (told->rule.durability == Durability::kVolatile) weakest.durability = told->rule.durability;
  }
  return weakest;
}

TellOnce& FarListeners::told_of(const TopicKey& topic) const {
  const Topic* const known = counting(topic);
  return known ? links_.at(known->links.begin()->first).link->account->told : side_.outputs.told();
}

}  // namespace connect_bridge
