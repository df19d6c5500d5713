// Which topics are offered to which link, and what changes when the graph, a rule or a link does.
#include <algorithm>

#include "core/link/options.hpp"
#include "core/topics/exports.hpp"

namespace connect_bridge {
namespace {

// A publisher that left the graph keeps its origin for a moment: its last samples may still be
// under way from the middleware to us (`ros2 topic pub --once` ends right after its message).
constexpr Duration kLinger = std::chrono::milliseconds(300);
constexpr Duration kLingerMax = std::chrono::seconds(3);  // while its samples wait in a queue

bool is_clock(const TopicKey& key) {
  return key.first == "/clock" && key.second == "rosgraph_msgs/msg/Clock";
}

}  // namespace

void Exports::on_graph(const GraphView& graph, const Now& now) {
  bridge_publishers_ = graph.bridge_publishers();
  for (const auto& [key, state] : graph.topics())
    if (!state.publishers.empty()) topics_[key].key = key;
  for (auto& [key, topic] : topics_) {
    const TopicState* state = graph.find(topic.key);
    if (state && !state->type_hash.empty()) topic.type_hash = state->type_hash;
    update_origins(topic, state, now);
    unpark(topic, now);
  }
}

void Exports::update_origins(Topic& topic, const TopicState* state, const Now& now) {
  std::vector<OriginOffer> added;
  std::size_t present = 0;
  if (state) {
    for (const auto& publisher : state->publishers) {
      if (topic.origins.size() >= kChannelOriginsMax && !topic.origins.contains(publisher.gid)) {
        continue;  // a peer would refuse the channel (docs/protocol.md, limits)
      }
      auto [it, is_new] = topic.origins.try_emplace(publisher.gid);
      Origin& origin = it->second;
      if (!is_new) {
        if (origin.vanishes_at) count_vanishing(topic, -1);
        origin.vanishes_at.reset();
        origin.lingering = false;
        // The graph may know an endpoint before the name of its node: told again, with the name.
        if (origin.node.empty() && !node_of(publisher).empty()) {
          origin.node = node_of(publisher);
          added.push_back({origin.id, publisher.gid, wire_node(origin), origin.qos});
        }
      } else {
        origin.id = {++topic.last_origin};
        origin.node = node_of(publisher);
        origin.qos = publisher.qos;
        added.push_back({origin.id, publisher.gid, wire_node(origin), origin.qos});
      }
      origin.seen = true;
      ++present;
    }
  }
  for (auto& [gid, origin] : topic.origins) {
    if (!origin.seen && !origin.vanishes_at) {
      origin.vanishes_at = now.steady + kLinger;
      count_vanishing(topic, 1);
    }
    origin.seen = false;
  }
  if (added.empty()) return;
  topic.failed = false;
  for (auto& [id, exported] : topic.links) {
    if (!exported.channel) continue;
    Link& link = links_.at(id);
    OriginsChanged change{exported.channel, {}, {}};
    for (auto origin : added) {
      origin.qos = with_override(origin.qos, exported.decision.treatment.qos);
      if (!is_withheld(link, topic.key, topic.origins.at(origin.gid))) {
        exported.withheld.erase(origin.origin);
        change.added.push_back(std::move(origin));
      } else {
        exported.withheld.insert(origin.origin);
      }
    }
    if (!change.added.empty()) link.send(change);
    // Its depth and lifespan were those of the origins known before.
    if (link.connection)
      link.connection->outbox().add_channel(exported.channel, queue_options(topic, exported));
  }
  warn_mixed(topic);
  update_subscription(topic, now);
}

void Exports::count_vanishing(Topic& topic, int change) {
  topic.vanishing += change;
  vanishing_ += change;
}

bool Exports::drained(const Topic& topic) const {
  for (const auto& [id, exported] : topic.links) {
    const Link& link = links_.at(id);
    if (exported.channel && link.connection &&
        link.connection->outbox().counts(exported.channel).queued > 0)
      return false;
  }
  return topic.parked.empty() &&
         std::all_of(topic.encoders.begin(), topic.encoders.end(),
                     [](const auto& e) { return e.second.encoder.bytes() == 0; });
}

void Exports::remove_vanished(Topic& topic, const Now& now) {
  std::vector<OriginId> removed;
  const bool is_drained = drained(topic);
  for (auto it = topic.origins.begin(); it != topic.origins.end();) {
    Origin& origin = it->second;
    if (!origin.vanishes_at || *origin.vanishes_at > now.steady) {
      ++it;
      continue;
    }
    if (!is_drained && !origin.lingering) {
      origin.lingering = true;
      origin.vanishes_at = now.steady + kLingerMax;
      ++it;
      continue;
    }
    removed.push_back(origin.id);
    topic.history.remove(origin.id);
    count_vanishing(topic, -1);
    it = topic.origins.erase(it);
  }
  if (removed.empty()) return;
  for (auto& [id, exported] : topic.links) {
    Link& link = links_.at(id);
    if (!exported.channel) continue;
    if (topic.origins.empty()) {
      withdraw(topic, link);
    } else {
      link.send(OriginsChanged{exported.channel, {}, removed});
      if (link.connection)
        link.connection->outbox().add_channel(exported.channel, queue_options(topic, exported));
    }
  }
  if (!topic.origins.empty()) {
    update_subscription(topic, now);
  } else {
    unsubscribe(topic);
  }
}

void Exports::on_time(const Now& now) {
  for (auto it = topics_.begin(); it != topics_.end();) {
    Topic& topic = it->second;
    if (!topic.parked.empty()) unpark(topic, now);
    if (topic.vanishing > 0) remove_vanished(topic, now);
    if (topic.subscribes_at && *topic.subscribes_at <= now.steady) update_subscription(topic, now);
    if (topic.origins.empty() && topic.parked.empty()) {
      it = topics_.erase(it);
    } else {
      ++it;
    }
  }
}

void Exports::recheck(Link& link, const Now& now) {
  for (auto& [key, topic] : topics_) {
    const auto it = topic.links.find(link.id);
    if (it == topic.links.end()) continue;
    const auto decision = permission(link, key);
    if (decision && it->second.channel && decision->treatment == it->second.decision.treatment &&
        withheld(link, topic) == it->second.withheld)
      continue;
    if (it->second.channel) withdraw(topic, link);
    topic.links.erase(it);
    update_subscription(topic, now);
  }
}

// Rules speak of names as the wire has them, so that one rule serves robots under any prefix.
std::optional<Decision> Exports::permission(const Link& link, const TopicKey& key) const {
  const auto wire_name = options_.names.to_wire(key.first);
  if (!wire_name) return std::nullopt;
  if (is_parameter_events(InterfaceKind::kTopic, *wire_name)) {
    // Each origin is decided on its own, see is_withheld().
    const auto& rules = link.accepts->rules;
    const bool accepted = std::any_of(rules.begin(), rules.end(),
                                      [](const auto& rule) { return !rule.parameters.empty(); });
    if (!accepted || key.second != kParameterEventType) return std::nullopt;
    return policy_.decide_parameter_events(link.identity);
  }
  const auto action_type = actions_.type_of(InterfaceKind::kTopic, key.first, key.second);
  if (!action_type) return std::nullopt;
  const Interface what{InterfaceKind::kTopic, *wire_name, key.second, *action_type};
  auto decision = policy_.decide(Direction::kExport, what, link.identity);
  if (!decision || !accepted_by(*link.accepts, what)) return std::nullopt;
  return decision;
}

std::string Exports::wire_node(const Origin& origin) const {
  return options_.names.to_wire(origin.node).value_or(origin.node);
}

bool Exports::is_withheld(const Link& link, const TopicKey& key, const Origin& origin) const {
  if (key.second != kParameterEventType) return false;
  const auto wire_name = options_.names.to_wire(key.first);
  if (!wire_name || !is_parameter_events(InterfaceKind::kTopic, *wire_name)) return false;
  const auto node = options_.names.to_wire(origin.node);
  if (!node || !link.accepts) return true;
  const Interface what{InterfaceKind::kTopic, *wire_name, key.second, {}, *node};
  return !policy_.decide(Direction::kExport, what, link.identity) ||
         !accepted_by(*link.accepts, what);
}

std::set<OriginId> Exports::withheld(const Link& link, const Topic& topic) const {
  std::set<OriginId> result;
  if (topic.key.second != kParameterEventType) return result;
  for (const auto& [gid, origin] : topic.origins)
    if (is_withheld(link, topic.key, origin)) result.insert(origin.id);
  return result;
}

void Exports::collect_offers(Link& link, std::vector<ChannelOffer>& offers) {
  for (auto& [key, topic] : topics_) {
    if (topic.origins.empty() || topic.links.contains(link.id)) continue;
    if (auto channel = try_offer(topic, link)) offers.push_back(std::move(*channel));
  }
}

std::optional<ChannelOffer> Exports::try_offer(Topic& topic, Link& link) {
  Export& exported = topic.links[link.id];  // also remembers a "no", until rules or Accepts change
  auto decision = permission(link, topic.key);
  if (!decision) return std::nullopt;
  exported.withheld = withheld(link, topic);
  exported.decision = std::move(*decision);
  exported.channel = {++link.last_channel};
  const Treatment& treatment = exported.decision.treatment;
  exported.rate = RateLimit(treatment.max_rate, treatment.bytes_per_second_max);
  by_channel_[{link.id, exported.channel}] = &topic;
  QueueOptions queue = queue_options(topic, exported);
  link.connection->outbox().add_channel(exported.channel, queue);
  return describe(topic, exported);
}

QueueOptions Exports::queue_options(const Topic& topic, const Export& exported) const {
  const Treatment& treatment = exported.decision.treatment;
  QueueOptions queue;
  queue.priority = treatment.priority.value_or(default_priority(topic.key.first, topic.key.second));
  queue.queue_bytes_max = treatment.queue_bytes_max;
  queue.max_age = treatment.max_age;
  queue.newest_only = is_clock(topic.key);
  queue.lifespan = Duration::zero();
  std::uint32_t depth = 0;
  bool keep_all = false;
  std::uint32_t latched = 0;
  for (const auto& [gid, origin] : topic.origins) {
    const Qos qos = with_override(origin.qos, treatment.qos);
    depth = std::max(depth, qos.depth);
    keep_all = keep_all || qos.history == History::kKeepAll;
    if (qos.durability == Durability::kTransientLocal) ++latched;
    queue.lifespan = std::max(queue.lifespan, qos.lifespan);
  }
  queue.depth = depth > 0 ? depth : options_.default_depth;
  // Several origins share the queue of a transient-local topic, and all that is kept of each must
  // get through at once when demand begins.
  if (latched > 0) queue.depth = std::max(latched * history_depth(topic), options_.default_depth);
  if (keep_all) queue.depth = 0;
  return queue;
}

ChannelOffer Exports::describe(const Topic& topic, const Export& exported) const {
  const Treatment& treatment = exported.decision.treatment;
  ChannelOffer offer;
  offer.channel = exported.channel;
  offer.name = options_.names.to_wire(topic.key.first).value_or(topic.key.first);
  offer.action_type =
      actions_.type_of(InterfaceKind::kTopic, topic.key.first, topic.key.second).value_or("");
  offer.type = topic.key.second;
  offer.type_hash = topic.type_hash;
  offer.priority = treatment.priority.value_or(default_priority(topic.key.first, topic.key.second));
  offer.newest_only = is_clock(topic.key);
  for (const auto& [gid, origin] : topic.origins) {
    if (offer.origins.size() == kChannelOriginsMax) break;
    if (exported.withheld.contains(origin.id)) continue;
    offer.origins.push_back(
        {origin.id, gid, wire_node(origin), with_override(origin.qos, treatment.qos)});
  }
  return offer;
}

// Tells the peer that the channel is gone; the Export itself stays (or is erased) with the caller.
void Exports::withdraw(Topic& topic, Link& link) {
  Export& exported = topic.links.at(link.id);
  by_channel_.erase({link.id, exported.channel});
  if (link.connection) link.connection->outbox().remove_channel(exported.channel);
  link.send(Withdraw{{exported.channel}});
  exported.channel = {};
  exported.demanded = false;
}

void Exports::on_link_lost(LinkId id) {
  for (auto& [key, topic] : topics_) {
    const auto it = topic.links.find(id);
    if (it == topic.links.end()) continue;
    by_channel_.erase({id, it->second.channel});
    topic.links.erase(it);
    update_subscription(topic, Now{});
  }
}

void Exports::on_decline(Link& link, const Decline& decline, const Now& now) {
  Topic* topic = topic_of(link.id, decline.channel);
  if (!topic) return;
  if (!link.note_decline(topic->links.at(link.id).declined, decline, now)) return;
  outputs_.log(LogLevel::kWarn, link.label() + " does not import " + topic->key.first + ": " +
                                    decline.reason + " (" + decline.code + ")");
}

}  // namespace connect_bridge
