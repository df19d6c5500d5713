// Which topics are offered to which link, and what changes when the graph, a rule or a link does.
#include <algorithm>

#include "core/side/exports.hpp"
#include "core/side/side.hpp"

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
  for (auto& [id, link] : links_)
    if (link.open() && link.accepts) offer(link);
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
      } else {
        origin.id = {++topic.last_origin};
        origin.node = node_of(publisher);
        origin.qos = publisher.qos;
        added.push_back({origin.id, publisher.gid, origin.node, origin.qos});
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
    OriginsChanged change{exported.channel, added, {}};
    for (auto& origin : change.added)
      origin.qos = with_override(origin.qos, exported.decision.treatment.qos);
    LinkEntry& link = links_.at(id);
    link.send(change);
    // Its depth and lifespan were those of the origins known before.
    if (link.link)
      link.link->outbox().add_channel(exported.channel, queue_options(topic, exported));
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
    const LinkEntry& link = links_.at(id);
    if (exported.channel && link.link && link.link->outbox().counts(exported.channel).queued > 0)
      return false;
  }
  return topic.parked.empty() && std::all_of(topic.encoders.begin(), topic.encoders.end(),
                                             [](const auto& e) { return e.second.bytes() == 0; });
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
    LinkEntry& link = links_.at(id);
    if (!exported.channel) continue;
    if (topic.origins.empty()) {
      withdraw(topic, link);
    } else {
      link.send(OriginsChanged{exported.channel, {}, removed});
      if (link.link)
        link.link->outbox().add_channel(exported.channel, queue_options(topic, exported));
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

void Exports::on_accepts(LinkEntry& link, const Now& now) {
  recheck(link, now);
  offer(link);
}

void Exports::on_policy(const Now& now) {
  for (auto& [id, link] : links_) {
    if (!link.open() || !link.accepts) continue;
    recheck(link, now);
    offer(link);
  }
}

// Withdraws what is no longer allowed or is treated differently now; offer() then offers it anew.
void Exports::recheck(LinkEntry& link, const Now& now) {
  for (auto& [key, topic] : topics_) {
    const auto it = topic.links.find(link.id);
    if (it == topic.links.end()) continue;
    const auto wire_name = options_.names.to_wire(key.first);
    const auto decision = permission(link, wire_name, key.second);
    if (decision && it->second.channel && decision->treatment == it->second.decision.treatment)
      continue;
    if (it->second.channel) withdraw(topic, link);
    topic.links.erase(it);
    update_subscription(topic, now);
  }
}

// Rules speak of names as the wire has them, so that one rule serves robots under any prefix.
std::optional<Decision> Exports::permission(const LinkEntry& link,
                                            const std::optional<std::string>& wire_name,
                                            const std::string& type) const {
  if (!wire_name) return std::nullopt;
  auto decision =
      policy_.decide(Direction::kExport, InterfaceKind::kTopic, *wire_name, type, link.identity);
  if (!decision || !accepted_by(*link.accepts, {InterfaceKind::kTopic, *wire_name, type}))
    return std::nullopt;
  return decision;
}

void Exports::offer(LinkEntry& link) {
  std::vector<ChannelOffer> channels;
  for (auto& [key, topic] : topics_) {
    if (topic.origins.empty() || topic.links.contains(link.id)) continue;
    if (auto channel = try_offer(topic, link)) channels.push_back(std::move(*channel));
  }
  if (channels.empty() && link.offers_complete) return;
  for (auto& text : encode_offers(channels, !link.offers_complete)) link.send(std::move(text));
  link.offers_complete = true;
}

std::optional<ChannelOffer> Exports::try_offer(Topic& topic, LinkEntry& link) {
  const auto& [name, type] = topic.key;
  Export& exported = topic.links[link.id];  // also remembers a "no", until rules or Accepts change
  const auto wire_name = options_.names.to_wire(name);
  auto decision = permission(link, wire_name, type);
  if (!decision) return std::nullopt;
  exported.decision = std::move(*decision);
  exported.channel = {++link.last_channel};
  const Treatment& treatment = exported.decision.treatment;
  exported.rate = RateLimit(treatment.max_rate, treatment.bytes_per_second_max);
  by_channel_[{link.id, exported.channel}] = &topic;
  QueueOptions queue = queue_options(topic, exported);
  link.link->outbox().add_channel(exported.channel, queue);
  return describe(topic, exported, *wire_name);
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

ChannelOffer Exports::describe(const Topic& topic, const Export& exported,
                               const std::string& wire_name) const {
  const Treatment& treatment = exported.decision.treatment;
  ChannelOffer offer;
  offer.channel = exported.channel;
  offer.name = wire_name;
  offer.type = topic.key.second;
  offer.type_hash = topic.type_hash;
  offer.priority = treatment.priority.value_or(default_priority(topic.key.first, topic.key.second));
  offer.newest_only = is_clock(topic.key);
  for (const auto& [gid, origin] : topic.origins) {
    if (offer.origins.size() == kChannelOriginsMax) break;
    offer.origins.push_back(
        {origin.id, gid, origin.node, with_override(origin.qos, treatment.qos)});
  }
  return offer;
}

// Tells the peer that the channel is gone; the Export itself stays (or is erased) with the caller.
void Exports::withdraw(Topic& topic, LinkEntry& link) {
  Export& exported = topic.links.at(link.id);
  by_channel_.erase({link.id, exported.channel});
  if (link.link) link.link->outbox().remove_channel(exported.channel);
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

void Exports::on_decline(LinkEntry& link, const Decline& decline) {
  Topic* topic = topic_of(link.id, decline.channel);
  if (!topic) return;
  if (topic->links.at(link.id).declined == decline.reason) return;
  topic->links.at(link.id).declined = decline.reason;
  outputs_.log(LogLevel::kWarn, link.label() + " does not import " + topic->key.first + ": " +
                                    decline.reason + " (" + decline.code + ")");
}

}  // namespace connect_bridge
