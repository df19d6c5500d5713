#include "core/topics/local_listeners.hpp"

#include "core/offers/import_right.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {
bool LocalListeners::permits(Told& told, const Link& link, const TopicKey& topic) const {
  const auto [known, is_new] = told.permitted.try_emplace(topic, false);
  if (!is_new) return known->second;
  const auto wire_name = link.names.to_wire(topic.first);
  if (!wire_name || has_action_token(*wire_name)) return false;
  const Interface what{InterfaceKind::kTopic, *wire_name, topic.second};
  known->second = import_right(side_, link, what).has_value();  // mutant: told_listeners
  return known->second;
}

void LocalListeners::tell(Link& link) {
  if (!link.open()) return;
  Told& told = links_[link.id];
  // Rules are checked once for each topic and link, as this runs with each picture of the graph.
  // Topics that left the graph are forgotten, so these answers need no more memory than the graph.
  std::erase_if(told.permitted, [&](const auto& p) { return !side_.graph.find(p.first); });
  const auto is_listened_to = [&](const TopicKey& topic, const TopicState* state) {
    return state && !state->subscribers.empty() && permits(told, link, topic);
  };
  Listeners change;
  std::erase_if(told.listeners, [&](const auto& listener) {
    const auto& [topic, id] = listener;
    if (is_listened_to(topic, side_.graph.find(topic))) return false;
    change.removed.push_back(id);
    return true;
  });
  for (const auto& [topic, state] : side_.graph.topics()) {
    if (told.listeners.contains(topic) || !is_listened_to(topic, &state)) continue;
    if (told.listeners.size() >= kListenersMax) {
      side_.outputs.log_once(link.account->told, LogLevel::kWarn,
                             "only " + std::to_string(kListenersMax) +
                                 " topics that are listened to here are reported to " +
                                 link.peer().node);
      break;
    }
    const ListenerId id = told.listeners[topic] = {++told.last};
    change.added.push_back({id, link.names.wire_name(topic.first), topic.second, state.type_hash});
  }
  if (!change.added.empty() || !change.removed.empty()) link.send(change);
}

void LocalListeners::recheck(Link& link) {
  if (const auto told = links_.find(link.id); told != links_.end()) told->second.permitted.clear();
  tell(link);
}

}  // namespace connect_bridge
