// The way of a sample: taken, attributed to its origin, admitted per link, compressed once, queued.
#include <algorithm>
#include <bit>

#include "core/link/options.hpp"
#include "core/topics/exports.hpp"

namespace connect_bridge {
namespace {

// A peer may switch its demand on and off as it likes; it makes a reader of the middleware so often
// at once, and then once per period.
constexpr int kSubscriptionsAtOnce = 10;
constexpr Duration kSubscriptionPeriod = std::chrono::seconds(1);
constexpr Duration kParkMax = std::chrono::seconds(1);
constexpr std::uint64_t kReaderDepthMax = 1 << 16;
constexpr std::size_t kParkedSamplesMax = 256;       // per topic
constexpr std::uint64_t kParkedBytesMax = 64 << 20;  // all topics

// Whether a subscription is good enough for what is wanted now. To make it anew loses what volatile
// publishers send until the graph has matched it, so depth alone is no reason: samples are taken at
// once. Of transient-local publishers it limits the history that comes with the subscription.
bool serves(const Qos& present, const Qos& wanted) {
  return present.reliability == wanted.reliability && present.durability == wanted.durability &&
         (wanted.durability == Durability::kVolatile || wanted.depth <= present.depth);
}

}  // namespace

Result<Nothing> Exports::on_demand(Link& link, const Demand& demand, const Now& now) {
  for (const ChannelId channel : demand.channels) {
    Topic* topic = topic_of(link.id, channel);
    if (!topic) continue;  // withdrawn while the demand was on its way
    Export& exported = topic->links.at(link.id);
    if (exported.demanded == demand.on) continue;
    exported.demanded = demand.on;
    if (!demand.on) {
      link.connection->outbox().clear_channel(channel);
      update_subscription(*topic, now);
    } else if (topic->subscription) {
      update_subscription(*topic, now);
      send_history(*topic, exported, link, now);
    } else {
      update_subscription(*topic, now);
    }
  }
  return Nothing{};
}

Qos Exports::wanted_qos(const Topic& topic) const {
  Qos qos;
  qos.durability = Durability::kTransientLocal;
  std::uint32_t depth = 0;
  for (const auto& [gid, origin] : topic.origins) {
    if (origin.qos.reliability == Reliability::kBestEffort)
      qos.reliability = Reliability::kBestEffort;
    if (origin.qos.durability == Durability::kVolatile) qos.durability = Durability::kVolatile;
    if (origin.qos.history == History::kKeepAll) qos.history = History::kKeepAll;
    depth = std::max(depth, origin.qos.depth);
  }
  // An override can ask for less than the publishers offer, never for more: that would match
  // nothing.
  for (const auto& [id, exported] : topic.links) {
    const QosOverride& o = exported.decision.treatment.qos;
    if (!exported.demanded) continue;
    if (o.reliability == Reliability::kBestEffort) qos.reliability = Reliability::kBestEffort;
    if (o.durability == Durability::kVolatile) qos.durability = Durability::kVolatile;
    if (o.depth) depth = std::max(depth, *o.depth);
  }
  // The samples of all transient-local publishers come at once; a power of two, so that not every
  // publisher that joins makes the subscription anew.
  const bool latched = qos.durability == Durability::kTransientLocal;
  if (latched) depth = std::max(depth, options_.latched_depth);
  const auto all = latched ? std::min<std::uint64_t>(std::uint64_t{depth} * topic.origins.size(),
                                                     kReaderDepthMax)
                           : std::uint64_t{depth};
  const auto wanted = static_cast<std::uint32_t>(latched ? std::bit_ceil(all) : all);
  qos.depth = std::max(wanted, options_.default_depth);
  return qos;
}

// What a late local subscriber would get of one origin, as far as the graph tells.
std::uint32_t Exports::history_depth(const Topic& topic) const {
  std::uint32_t depth = 0;
  for (const auto& [gid, origin] : topic.origins) depth = std::max(depth, origin.qos.depth);
  if (depth == 0) depth = options_.latched_depth;
  for (const auto& [id, exported] : topic.links)
    depth = std::max(depth, exported.decision.treatment.qos.depth.value_or(0));
  return depth;
}

void Exports::update_subscription(Topic& topic, const Now& now) {
  if (std::exchange(topic.subscribes_at, std::nullopt)) --late_subscriptions_;
  const bool demanded = std::any_of(topic.links.begin(), topic.links.end(),
                                    [](const auto& e) { return e.second.demanded; });
  const bool held = demanded || held_.contains(topic.key.first);
  if (!held || topic.origins.empty()) return unsubscribe(topic);
  if (topic.failed) return;
  const Qos qos = wanted_qos(topic);
  topic.history.limit(history_depth(topic), options_.history_bytes_max);
  if (topic.subscription && serves(topic.subscription_qos, qos)) return;
  if (topic.subscription) {
    outputs_.push(DestroySubscription{topic.subscription});
    by_subscription_.erase(topic.subscription);
  } else if (!may_subscribe(topic, now)) {
    return;
  }
  topic.subscription = outputs_.new_subscription();
  topic.subscription_qos = qos;
  if (qos.durability == Durability::kVolatile) topic.history.clear();  // it would grow stale
  by_subscription_[topic.subscription] = &topic;
  outputs_.push(CreateSubscription{topic.subscription, topic.key.first, topic.key.second,
                                   topic.type_hash, qos});
}

bool Exports::may_subscribe(Topic& topic, const Now& now) {
  const TimePoint free_at = topic.paid_until - (kSubscriptionsAtOnce - 1) * kSubscriptionPeriod;
  if (free_at > now.steady) {
    topic.subscribes_at = free_at;
    ++late_subscriptions_;
    return false;
  }
  topic.paid_until = std::max(topic.paid_until, now.steady) + kSubscriptionPeriod;
  return true;
}

void Exports::hold_action(const std::string& action, bool on, const Now& now) {
  for (const ActionPart part : {ActionPart::kFeedback, ActionPart::kStatus}) {
    const std::string name = name_of_part(action, part);
    if (on) {
      held_.insert(name);
    } else {
      held_.erase(name);
    }
    for (auto it = topics_.lower_bound({name, ""}); it != topics_.end() && it->first.first == name;
         ++it)
      update_subscription(it->second, now);
  }
}

void Exports::unsubscribe(Topic& topic) {
  if (std::exchange(topic.subscribes_at, std::nullopt)) --late_subscriptions_;
  if (topic.subscription) {
    outputs_.push(DestroySubscription{topic.subscription});
    by_subscription_.erase(topic.subscription);
  }
  topic.subscription = {};
  topic.history.clear();
  for (auto& [gid, origin] : topic.origins) origin.last_stamp = 0;
  for (auto& [how, stream] : topic.encoders)
    for (const auto& sample : stream.encoder.clear()) drop(topic, sample, DropReason::kNoDemand);
  for (const auto& parked : topic.parked) parked_bytes_ -= parked.taken.payload.size();
  parked_samples_ -= topic.parked.size();
  topic.parked.clear();
}

void Exports::warn_mixed(Topic& topic) {
  if (topic.warned_mixed) return;
  bool latched = false;
  bool is_volatile = false;
  for (const auto& [gid, origin] : topic.origins)
    (origin.qos.durability == Durability::kTransientLocal ? latched : is_volatile) = true;
  if (!latched || !is_volatile) return;
  topic.warned_mixed = true;
  outputs_.log(LogLevel::kWarn,
               topic.key.first +
                   " has transient-local and volatile publishers: it is subscribed as volatile, so "
                   "samples from before the subscription do not cross");
}

void Exports::on_taken(MessageTaken taken, const Now& now) {
  const auto it = by_subscription_.find(taken.subscription);
  if (it == by_subscription_.end()) return;
  Topic& topic = *it->second;
  if (taken.stamp == 0) taken.stamp = now.system;
  auto origin = taken.origin == Gid{} ? topic.origins.begin() : topic.origins.find(taken.origin);
  if (origin != topic.origins.end()) return forward(topic, origin->second, std::move(taken), now);
  if (bridge_publishers_.contains(taken.origin)) return;
  if (topic.parked.size() >= kParkedSamplesMax || parked_bytes_ >= kParkedBytesMax) {
    for (auto& [id, exported] : topic.links)
      if (exported.demanded) exported.dropped.add(DropReason::kUnknownOrigin);
    return;
  }
  if (topic.parked.empty()) outputs_.push(RefreshGraph{});
  parked_bytes_ += taken.payload.size();
  ++parked_samples_;
  topic.parked.push_back({std::move(taken), now.steady + kParkMax});
}

void Exports::unpark(Topic& topic, const Now& now) {
  std::deque<Parked> parked;
  parked.swap(topic.parked);
  for (auto& sample : parked) {
    const auto origin = topic.origins.find(sample.taken.origin);
    if (origin == topic.origins.end() && sample.until > now.steady) {
      topic.parked.push_back(std::move(sample));
      continue;
    }
    parked_bytes_ -= sample.taken.payload.size();
    --parked_samples_;
    if (origin != topic.origins.end()) {
      forward(topic, origin->second, std::move(sample.taken), now);
      continue;
    }
    if (bridge_publishers_.contains(sample.taken.origin)) continue;
    for (auto& [id, exported] : topic.links)
      if (exported.demanded) exported.dropped.add(DropReason::kUnknownOrigin);
  }
}

void Exports::forward(Topic& topic, Origin& origin, MessageTaken taken, const Now& now) {
  const bool latched = topic.subscription_qos.durability == Durability::kTransientLocal;
  if (latched) {
    // A subscription made anew (changed QoS) gets the history again.
    if (taken.stamp <= origin.last_stamp) return;
    origin.last_stamp = taken.stamp;
    topic.history.add(origin.id, taken.stamp, taken.payload);
  }
  OutSample sample{origin.id, taken.stamp, std::move(taken.payload), {}};
  const Compression* compressed = nullptr;
  bool several = false;
  for (auto& [id, exported] : topic.links) {
    if (!exported.demanded || exported.withheld.contains(origin.id)) continue;
    Link& link = links_.at(id);
    if (!admit(exported, link, sample.raw.size(), now)) continue;
    const Compression& how = exported.decision.treatment.compression;
    if (how.codec == Codec::kNone) {
      deliver(topic, id, sample, Codec::kNone, sample.raw, now);
      continue;
    }
    several = several || (compressed && *compressed != how);
    compressed = &how;
    sample.targets.push_back(id);
  }
  if (!compressed) return;
  if (!several) return encode(topic, *compressed, std::move(sample), now);
  std::map<Compression, std::vector<LinkId>> groups;
  for (const LinkId id : sample.targets)
    groups[topic.links.at(id).decision.treatment.compression].push_back(id);
  for (auto& [how, targets] : groups)
    encode(topic, how, OutSample{sample.origin, sample.stamp, sample.raw, std::move(targets)}, now);
}

bool Exports::admit(Export& exported, const Link& link, std::size_t bytes, const Now& now) {
  if (!link.open()) return false;
  if (bytes > link.connection->peer().message_bytes_max) {
    if (exported.dropped.of(DropReason::kTooLarge) == 0) {
      outputs_.log(LogLevel::kWarn, "a message of " + std::to_string(bytes) + " bytes for rule " +
                                        exported.decision.rule + " is larger than " + link.label() +
                                        " accepts; such messages are dropped");
    }
    exported.dropped.add(DropReason::kTooLarge);
    return false;
  }
  if (!exported.rate.admit(bytes, now.steady)) {
    exported.dropped.add(DropReason::kRate);
    return false;
  }
  return true;
}

Encoder& Exports::encoder(Topic& topic, const Compression& how) {
  const auto it = topic.encoders.find(how);
  if (it != topic.encoders.end()) return it->second.encoder;
  Encoder::Options options;
  options.how = how;
  // Of a transient-local topic each origin's last samples must get through, and they come at once.
  const bool latched = topic.subscription_qos.durability == Durability::kTransientLocal;
  options.depth = latched ? 0 : topic.subscription_qos.depth;
  options.queue_bytes_max = 4 << 20;
  return topic.encoders.try_emplace(how, *this, topic, options).first->second.encoder;
}

void Exports::encode(Topic& topic, const Compression& how, OutSample sample, const Now& now) {
  Encoder& by = encoder(topic, how);
  for (const auto& displaced : by.push(std::move(sample)))
    drop(topic, displaced, DropReason::kQueueBytes);
  send_encoded(topic, by, now);
}

void Exports::send_encoded(Topic& topic, Encoder& encoder, const Now& now) {
  while (const auto ready = encoder.next())
    for (const LinkId link : ready->sample.targets)
      deliver(topic, link, ready->sample, ready->codec, ready->body, now);
}

void Exports::deliver(Topic& topic, LinkId id, const OutSample& sample, Codec codec,
                      const Payload& body, const Now& now) {
  const auto it = topic.links.find(id);
  const auto link = links_.find(id);
  if (it == topic.links.end() || link == links_.end() || !link->second.open()) return;
  if (!it->second.demanded) return it->second.dropped.add(DropReason::kNoDemand);
  it->second.raw_bytes += sample.raw.size();
  OutMessage message;
  message.origin = sample.origin;
  message.stamp = sample.stamp;
  message.codec = codec;
  message.raw_bytes = static_cast<std::uint32_t>(sample.raw.size());
  message.body = body;
  link->second.connection->outbox().push(it->second.channel, std::move(message), now);
}

void Exports::send_history(Topic& topic, Export& exported, Link& link, const Now& now) {
  const Compression how = exported.decision.treatment.compression;
  topic.history.for_each([&](OriginId origin, Stamp stamp, const Payload& raw) {
    if (exported.withheld.contains(origin)) return;
    OutSample sample{origin, stamp, raw, {link.id}};
    if (raw.size() > link.connection->peer().message_bytes_max)
      return exported.dropped.add(DropReason::kTooLarge);
    if (how.codec == Codec::kNone) return deliver(topic, link.id, sample, Codec::kNone, raw, now);
    encode(topic, how, std::move(sample), now);
  });
}

void Exports::drop(Topic& topic, const OutSample& sample, DropReason reason) {
  for (const LinkId id : sample.targets) {
    const auto it = topic.links.find(id);
    if (it != topic.links.end()) it->second.dropped.add(reason);
  }
}

}  // namespace connect_bridge
