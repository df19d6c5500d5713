#include "core/mirrors/local_listeners.hpp"

#include <string>

#include "core/offers/import_right.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {

bool LocalListeners::is_listened_to(const Link& link, const TopicKey& topic,
                                    const TopicState* state) const {
  if (!state || state->subscribers.empty()) return false;
  const auto wire_name = link.names.to_wire(topic.first);
  if (!wire_name || has_action_token(*wire_name)) return false;
  const Interface what{InterfaceKind::kTopic, *wire_name, topic.second};
  return import_right(side_, link, what).has_value();  // mutant: reported_listeners
}

void LocalListeners::begin(Link& link, const Now& now) {
  news_.begin(link);
  go_on(now);
}

void LocalListeners::on_graph(const GraphDifference& difference, const Now& now) {
  news_.note(difference.listened);  // mutant: listener_missed
  go_on(now);
}

void LocalListeners::recheck(Link& link) {
  OfLink* const of = news_.find(link.id);
  if (!of || !link.open()) return;
  Listeners change;
  std::erase_if(links_[link.id].listeners, [&](const auto& listener) {
    const auto& [topic, id] = listener;
    if (is_listened_to(link, topic, side_.graph.find(topic))) return false;
    change.removed.push_back(id);
    return true;
  });
  if (!change.removed.empty()) link.send(change);
  news_.again(*of);
}

void LocalListeners::on_link_lost(LinkId link) {
  links_.erase(link);
  news_.forget(link);
}

void LocalListeners::go_on(bool pays, const Now& now) {
  news_.give_turns(left_, [&](OfLink& of) {
    const Outputs::Paying paying(side_.outputs,
                                 pays ? of.link->account->time : side_.outputs.payer());
    return tell(of);
  });
  // A place that has become free is for those that found none.
  news_.again_if([&](const OfLink& of) {
    return of.full && links_[of.link->id].listeners.size() < kListenersMax;
  });
  goes_on_at_.reset();
  if (news_.waits()) goes_on_at_ = now.steady;
}

bool LocalListeners::tell(OfLink& of) {
  Link& link = *of.link;
  if (!link.open()) return true;  // its end follows
  Reported& reported = links_[link.id];
  Listeners change;
  of.all.left = left_;
  const auto look_at = [&](const TopicKey& topic) { look(topic, of, reported, change); };
  const auto all = [&] {
    return of.all.each(side_.graph.topics(), [&](const TopicState& topic) {
      look_at({topic.name, topic.type});
    });
  };
  const bool over = of.all.part(0, all) && news_.each(of, of.all, look_at);
  left_ = of.all.left;
  if (!change.added.empty() || !change.removed.empty()) link.send(change);
  return over;
}

void LocalListeners::look(const TopicKey& topic, OfLink& of, Reported& reported,
                          Listeners& change) const {
  Link& link = *of.link;
  const TopicState* const state = side_.graph.find(topic);
  const auto known = reported.listeners.find(topic);
  const bool is_known = known != reported.listeners.end();
  if (is_known == is_listened_to(link, topic, state)) return;
  if (is_known) {
    change.removed.push_back(known->second);
    reported.listeners.erase(known);
  } else if (reported.listeners.size() < kListenersMax) {
    const ListenerId id = reported.listeners[topic] = {++reported.last};
    change.added.push_back({id, link.names.wire_name(topic.first), topic.second, state->type_hash});
  } else {
    of.full = true;
    side_.outputs.log_once(link.account->logged, LogLevel::kWarn,
                           "only " + std::to_string(kListenersMax) +
                               " topics that are listened to here are reported to " +
                               link.peer().node);
    return;
  }
  of.all.charge(kLooks - 1);
}

}  // namespace connect_bridge
