#include "core/topics/told_listeners.hpp"

#include <algorithm>

#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

// Two subscriptions of a node are one listener: it asks for what serves both.
Qos weakest(Qos a, const Qos& b) {
  if (b.reliability == Reliability::kBestEffort) a.reliability = b.reliability;
  if (b.durability == Durability::kVolatile) a.durability = b.durability;
  a.depth = std::max(a.depth, b.depth);
  return a;
}

}  // namespace

bool ToldListeners::permits(Told& told, const Link& link, const TopicKey& topic) const {
  const auto [known, is_new] = told.permitted.try_emplace(topic, false);
  if (!is_new) return known->second;
  const auto wire_name = side_.graph_options.names.to_wire(topic.first);
  if (!wire_name || has_action_token(*wire_name)) return false;
  const Interface what{InterfaceKind::kTopic, *wire_name, topic.second};
  known->second = side_.policy.decide(Direction::kImport, what, link.login.identity())
                      .has_value();  // mutant: told_listeners
  return known->second;
}

std::map<ToldListeners::Key, ToldListeners::Listener> ToldListeners::listeners_for(
    Told& told, const Link& link) const {
  std::map<Key, Listener> listeners;
  for (const auto& [topic, state] : side_.graph.topics()) {
    if (state.subscribers.empty() || !permits(told, link, topic)) continue;
    for (const auto& subscriber : state.subscribers) {
      const std::string node = node_of(subscriber);
      const Key key{topic, side_.wire_name(node)};
      const auto [known, is_new] =
          listeners.try_emplace(key, Listener{{}, state.type_hash, subscriber.qos});
      if (!is_new) known->second.qos = weakest(known->second.qos, subscriber.qos);
    }
  }
  return listeners;
}

void ToldListeners::tell(Link& link) {
  if (!link.open()) return;
  Told& told = links_[link.id];
  // Rules are asked once for each topic and link, as this runs with each picture of the graph. What
  // left the graph is forgotten, so that the memory of answers stays as large as the graph.
  std::erase_if(told.permitted, [&](const auto& p) { return !side_.graph.find(p.first); });
  auto present = listeners_for(told, link);
  Listeners change;
  for (auto it = told.listeners.begin(); it != told.listeners.end();) {
    const auto still = present.find(it->first);
    // Of a listener nothing can be changed on the wire: with another QoS it goes, and comes again
    // under a new number.
    if (still != present.end() && still->second.qos == it->second.qos) {
      ++it;
      continue;
    }
    change.removed.push_back(it->second.id);
    it = told.listeners.erase(it);
  }
  for (const auto& [key, listener] : present) {
    if (told.listeners.contains(key)) continue;
    if (told.listeners.size() >= kListenersMax) {
      side_.outputs.log_once(link.account->told, LogLevel::kWarn,
                             "only " + std::to_string(kListenersMax) +
                                 " listeners are reported to " + link.peer().node);
      break;
    }
    const ListenerId id{++told.last};
    told.listeners[key] = {id, listener.type_hash, listener.qos};
    const auto& [topic, node] = key;
    change.added.push_back(
        {id, side_.wire_name(topic.first), topic.second, listener.type_hash, node, listener.qos});
  }
  if (!change.added.empty() || !change.removed.empty()) link.send(change);
}

void ToldListeners::recheck(Link& link) {
  if (const auto told = links_.find(link.id); told != links_.end()) told->second.permitted.clear();
  tell(link);
}

}  // namespace connect_bridge
