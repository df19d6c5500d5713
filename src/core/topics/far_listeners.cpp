#include "core/topics/far_listeners.hpp"

#include <cstdint>
#include <limits>

#include "core/offers/export_right.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

// What the subscription to a topic that nobody publishes costs the middleware, roughly.
constexpr std::uint64_t kSubscriptionBytes = 20 << 10;

// Types of one name for which listeners of an identity count. With some middlewares one of them can
// be subscribed, and when it ends the others are looked at.
constexpr std::size_t kTypesOfTopicMax = 4;

// Calls `visit` with each link and one of its listeners.
template <class Listeners, class Visit>
void for_each_link(const Listeners& listeners, const Visit& visit) {
  constexpr ListenerId kLast{std::numeric_limits<std::uint32_t>::max()};
  for (auto at = listeners.begin(); at != listeners.end();
       at = listeners.upper_bound({at->first.first, kLast}))
    visit(at->first.first, *at->second);
}

}  // namespace

// ---- what peers tell

Result<Nothing> FarListeners::on_listeners(Link& link, const Listeners& change, const Now& now) {
  OfLink& of_link = links_[link.id];
  of_link.link = &link;
  auto& listeners = of_link.listeners;
  // Those that go are first (docs/protocol.md, "listeners"), so a peer at its limit can replace all
  // in one message. Each may end a subscription here, so a peer must not do that without a pause.
  for (const ListenerId gone : change.removed) {
    const auto it = listeners.find(gone);
    if (it == listeners.end()) continue;
    set({link.id, gone}, it->second, false);
    listeners.erase(it);
    if (!link.note_withdrawal(now))
      return Error{CloseCode::kTooLarge, "listeners come and go too often"};
  }
  if (listeners.size() + change.added.size() > kListenersMax)
    return Error{CloseCode::kTooLarge, "more listeners than this side accepts"};
  for (const auto& told : change.added) {
    if (listeners.contains(told.listener))
      return Error{CloseCode::kIllegal, "the number of a listener is in use"};
    add(link, told, now);
  }
  return Nothing{};
}

void FarListeners::add(const Link& link, const ListenerTold& told, const Now& now) {
  Listener& listener = links_[link.id].listeners[told.listener];
  listener.told = told;
  const std::string local = side_.graph_options.names.to_local(told.name);
  // Another name may be mapped to it; and the claims topic is not for peers.
  const bool is_ours =
      side_.graph_options.names.to_wire(local) == told.name && local != kClaimsTopic;
  if (is_ours && !has_action_token(told.name)) listener.topic = TopicKey{local, told.type};
  decide(link, listener);
  admit({link.id, told.listener}, listener, now);
}

// By both sides' rules for a topic that this side exports (docs/protocol.md, "listeners", rule 2).
// Parts of actions and what is not ours by its name have no topic, and are never permitted.
void FarListeners::decide(const Link& link, Listener& listener) const {
  listener.permitted = false;
  if (!listener.topic || !link.accepts) return;
  const Interface what{InterfaceKind::kTopic, listener.told.name, listener.told.type};
  const auto right = export_right(side_, link, what);
  if (!right.is_allowed_here()) return;
  listener.permitted = right.answer == ExportRight::Answer::kYes;
  listener.rule = right.decision.treatment.qos;
}

void FarListeners::review(const Link& link, const Now& now) {
  const auto of_link = links_.find(link.id);
  if (of_link == links_.end()) return;
  for (auto& [id, listener] : of_link->second.listeners) {
    const QosOverride before = listener.rule;
    decide(link, listener);
    // The topic may have to be subscribed in another way (rules_of).
    if (listener.counts && !(listener.rule == before)) changed_.insert(*listener.topic);
    admit({link.id, id}, listener, now);
  }
}

void FarListeners::on_link_lost(LinkId link) {
  const auto of_link = links_.find(link);
  if (of_link == links_.end()) return;
  for (auto& [id, listener] : of_link->second.listeners) set({link, id}, listener, false);
  links_.erase(of_link);
}

void FarListeners::on_time(const Now& now) {
  if (!due_ || *due_ > now.steady) return;
  due_.reset();
  for (auto& [link, of_link] : links_)
    for (auto& [id, listener] : of_link.listeners) admit({link, id}, listener, now);
}

// A subscription that comes or goes costs every process of the graph, and this one's loop.
void FarListeners::admit(Key key, Listener& listener, const Now& now) {
  const bool is_new = listener.permitted && !listener.counts;
  OfLink& of_link = links_.at(key.first);
  if (is_new) {
    const Duration wait = wait_to_count(of_link, *listener.topic, now);
    if (wait == Account::kPacing && !std::exchange(listener.waits, true))
      of_link.link->mirrors.note_wait();
    if (wait > Duration::zero()) {
      due_ = earliest(due_, now.steady + wait);
      return;
    }
    listener.held = of_link.link->account->memory.hold(kSubscriptionBytes);
  }
  listener.waits = false;
  set(key, listener, listener.permitted);
}

Duration FarListeners::wait_to_count(const OfLink& of_link, const TopicKey& topic, const Now& now) {
  Account& account = *of_link.link->account;
  const char* lacking = nullptr;
  if (of_link.counting >= options_.listeners_max) lacking = "it has too many";
  if (account.memory.room() < kSubscriptionBytes)
    lacking = "no memory is left in its share (memory_max)";
  if (has_too_many_types(account, topic)) lacking = "a name has too many types";
  if (!lacking) return account.wait_to_appear(account.listeners, now.steady);
  // It may be there when others end, which nobody tells: so it is asked for again.
  side_.outputs.log_once(
      account.told, LogLevel::kWarn,
      "not all listeners of a peer have a subscription here: " + std::string(lacking));
  return Account::kPacing;
}

bool FarListeners::has_too_many_types(const Account& account, const TopicKey& topic) const {
  std::size_t others = 0;
  for (auto it = topics_.lower_bound({topic.first, ""});
       it != topics_.end() && it->first.first == topic.first; ++it) {
    bool is_its_own = false;
    for_each_link(it->second.listeners, [&](LinkId link, const Listener&) {
      is_its_own = is_its_own || links_.at(link).link->account.get() == &account;
    });
    if (it->first != topic && is_its_own) ++others;
  }
  return others >= kTypesOfTopicMax;
}

void FarListeners::set(Key key, Listener& listener, bool counts) {
  if (std::exchange(listener.counts, counts) == counts) return;
  links_.at(key.first).counting += counts ? 1 : -1;
  changed_.insert(*listener.topic);
  const auto topic = topics_.try_emplace(*listener.topic).first;
  // Who joins a topic that is subscribed already is shown at once; the others when it is (show).
  if (counts) {
    topic->second.listeners[key] = &listener;
    if (topic->second.shown) show(listener, true);
    return;
  }
  listener.held.release();
  topic->second.listeners.erase(key);
  show(listener, false);
  if (topic->second.listeners.empty()) topics_.erase(topic);
}

// ---- what they come to

bool FarListeners::listens(const TopicKey& topic, LinkId link) const {
  const auto known = topics_.find(topic);
  if (known == topics_.end()) return false;
  const auto first = known->second.listeners.lower_bound({link, {}});
  return first != known->second.listeners.end() && first->first.first == link;
}

std::string FarListeners::type_hash_of(const TopicKey& topic) const {
  const auto known = topics_.find(topic);
  if (known == topics_.end()) return {};
  return known->second.listeners.begin()->second->told.type_hash;
}

QosOverride FarListeners::rules_of(const TopicKey& topic,
                                   const std::function<bool(LinkId)>& count) const {
  QosOverride weakest;
  const auto known = topics_.find(topic);
  if (known == topics_.end()) return weakest;
  // The rule is the same for all listeners of a link.
  for_each_link(known->second.listeners, [&](LinkId link, const Listener& listener) {
    if (!count(link)) return;
    const QosOverride& rule = listener.rule;
    if (rule.reliability == Reliability::kBestEffort) weakest.reliability = rule.reliability;
    if (rule.durability == Durability::kVolatile) weakest.durability = rule.durability;
  });
  return weakest;
}

TellOnce& FarListeners::told_of(const TopicKey& topic) const {
  const auto known = topics_.find(topic);
  if (known == topics_.end()) return side_.outputs.told();
  return links_.at(known->second.listeners.begin()->first.first).link->account->told;
}

void FarListeners::show(const TopicKey& topic, bool on) {
  const auto known = topics_.find(topic);
  if (known == topics_.end() || std::exchange(known->second.shown, on) == on) return;
  for (const auto& [key, listener] : known->second.listeners) show(*listener, on);
}

// Publishers here see what it asks for, as they would in one graph.
void FarListeners::show(Listener& listener, bool on) {
  if (listener.shown) side_.outputs.push(DestroySubscription{std::exchange(listener.shown, {})});
  const std::string node = on ? side_.graph_options.owner_of(listener.told.node) : std::string();
  if (node.empty()) return;
  Qos qos;
  qos.reliability = listener.told.qos.reliability;
  qos.durability = listener.told.qos.durability;
  qos.depth = 1;
  listener.shown = side_.outputs.new_subscription();
  side_.outputs.push(CreateSubscription{listener.shown, listener.topic->first,
                                        listener.topic->second, listener.told.type_hash, qos,
                                        node});
}

}  // namespace connect_bridge
