#include "core/mirrors/local_listeners.hpp"

#include "core/offers/import_right.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {
bool LocalListeners::permits(Reported& reported, const Link& link, const TopicKey& topic) const {
  const auto [known, is_new] = reported.permitted.try_emplace(topic, false);
  if (!is_new) return known->second;
  const auto wire_name = link.names.to_wire(topic.first);
  if (!wire_name || has_action_token(*wire_name)) return false;
  const Interface what{InterfaceKind::kTopic, *wire_name, topic.second};
  known->second = import_right(side_, link, what).has_value();  // mutant: reported_listeners
  return known->second;
}

void LocalListeners::tell(Link& link) {
  if (!link.open()) return;
  Reported& reported = links_[link.id];
  // Rules are checked once for each topic and link, as this runs with each picture of the graph.
  // Topics that left the graph are forgotten, so these answers need no more memory than the graph.
  std::erase_if(reported.permitted, [&](const auto& p) { return !side_.graph.find(p.first); });
  const auto is_listened_to = [&](const TopicKey& topic, const TopicState* state) {
    return state && !state->subscribers.empty() && permits(reported, link, topic);
  };
  Listeners change;
  std::erase_if(reported.listeners, [&](const auto& listener) {
    const auto& [topic, id] = listener;
    if (is_listened_to(topic, side_.graph.find(topic))) return false;
    change.removed.push_back(id);
    return true;
  });
  for (const auto& [topic, state] : side_.graph.topics()) {
    if (reported.listeners.contains(topic) || !is_listened_to(topic, &state)) continue;
    if (reported.listeners.size() >= kListenersMax) {
      side_.outputs.log_once(link.account->logged, LogLevel::kWarn,
                             "only " + std::to_string(kListenersMax) +
                                 " topics that are listened to here are reported to " +
                                 link.peer().node);
      break;
    }
    const ListenerId id = reported.listeners[topic] = {++reported.last};
    change.added.push_back({id, link.names.wire_name(topic.first), topic.second, state.type_hash});
  }
  if (!change.added.empty() || !change.removed.empty()) link.send(change);
}

void LocalListeners::recheck(Link& link) {
  if (const auto reported = links_.find(link.id); reported != links_.end())
    reported->second.permitted.clear();
  tell(link);
}

}  // namespace connect_bridge
