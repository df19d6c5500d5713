#include "core/topics/topic_qos.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/topics/topic_offers.hpp"

namespace connect_bridge {
namespace {

// The depth for all transient-local publishers, whose samples come at once. A power of two, so that
// not every publisher that joins makes the subscription again.
std::uint32_t depth_for_all(std::uint32_t depth, std::size_t publishers) {
  constexpr std::uint64_t kMost = 1 << 16;
  return static_cast<std::uint32_t>(
      std::bit_ceil(std::min(std::uint64_t{depth} * publishers, kMost)));
}

// Stands for a depth of more than one.
constexpr std::uint32_t kUnknownDepth = std::numeric_limits<std::uint32_t>::max();

// A peer cannot make the middleware monitor shorter periods.
constexpr Duration kPeriodMin = std::chrono::milliseconds(1);

}  // namespace

// ---- the subscription here

Qos qos_for(const Origins& origins, const TopicOffers& offers, const QosOverride& weakest,
            const TopicOptions& options) {
  Qos qos;
  qos.durability = origins.empty() ? Durability::kVolatile : Durability::kTransientLocal;
  std::uint32_t depth = 0;
  for (const auto& [gid, origin] : origins) {
    if (origin.qos.reliability == Reliability::kBestEffort)
      qos.reliability = Reliability::kBestEffort;
    if (origin.qos.durability == Durability::kVolatile) qos.durability = Durability::kVolatile;
    if (origin.qos.history == History::kKeepAll) qos.history = History::kKeepAll;
    depth = std::max(depth, origin.qos.depth);
  }
  for (const auto& [link, offer] : offers.busy()) {
    const QosOverride& o = offer->treatment().qos;
    // The rule of a link without demand must not weaken the QoS for the others.
    if (!offer->demanded()) continue;
    if (o.reliability == Reliability::kBestEffort) qos.reliability = Reliability::kBestEffort;
    if (o.durability == Durability::kVolatile) qos.durability = Durability::kVolatile;
    if (o.depth) depth = std::max(depth, *o.depth);
  }
  if (weakest.reliability == Reliability::kBestEffort) qos.reliability = Reliability::kBestEffort;
  if (weakest.durability == Durability::kVolatile) qos.durability = Durability::kVolatile;
  if (weakest.depth) depth = std::max(depth, *weakest.depth);
  if (qos.durability == Durability::kTransientLocal) {
    depth = depth_for_all(std::max(depth, options.latched_depth), origins.size());
  }
  qos.depth = std::max(depth, options.default_depth);
  return qos;
}

// ---- the queue of a link

bool is_clock(const TopicKey& key) {
  return key.first == "/clock" && key.second == "rosgraph_msgs/msg/Clock";
}

Priority priority_of(const TopicKey& key, const Treatment& treatment) {
  return treatment.priority.value_or(default_priority(key.first, key.second));
}

QueueOptions queue_of(const TopicKey& key, const Origins& origins, std::uint64_t history_depth,
                      const Treatment& treatment, Keep keep, const TopicOptions& options) {
  QueueOptions queue;
  queue.priority = priority_of(key, treatment);
  queue.may_be_light = !treatment.priority && queue.priority != Priority::kUrgent &&
                       queue.priority != Priority::kBulk;
  // A limit of the operator holds for bursts, too. Without one, a burst may take as much as the
  // link allows one channel (Outbox::add_channel).
  if (treatment.queue_bytes_max > 0) {
    queue.queue_bytes_max = treatment.queue_bytes_max;
  } else {
    queue.burst_bytes_max = std::numeric_limits<std::uint64_t>::max();
  }
  queue.compression = treatment.compression;
  queue.max_age = treatment.max_age;
  queue.newest_only = is_clock(key);
  queue.lifespan = Duration::zero();
  std::uint32_t depth = 0;
  bool reliable = false;
  bool keep_all = false;
  std::uint32_t latched = 0;
  for (const auto& [gid, origin] : origins) {
    const Qos qos = qos_to_offer(origin.qos, treatment.qos);
    depth = std::max(depth, qos.depth);
    reliable = reliable || qos.reliability == Reliability::kReliable;
    keep_all = keep_all || qos.history == History::kKeepAll;
    if (qos.durability == Durability::kTransientLocal) ++latched;
    queue.lifespan = std::max(queue.lifespan, qos.lifespan);
  }
  // The origins share the queue: a message of one must not take the place of another's.
  const auto of_all = [](std::uint64_t count, std::uint64_t depth_of_each) {
    constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
    return static_cast<std::uint32_t>(std::min(count * depth_of_each, kMost));
  };
  // A reliable publisher with a small depth may publish more at once, and all of it would arrive in
  // one graph. For commands only the newest counts. Not every middleware reports the depth.
  const bool wants_more = (reliable && !drives(treatment, key)) || depth == 0;
  queue.depth = of_all(origins.size(), depth);
  if (wants_more) queue.depth = std::max(queue.depth, options.default_depth);
  // If each message counts, bytes and kWaitMax bound the queue: the depth that a publisher requests
  // is meant for a local graph.
  if (keep == Keep::kAll) queue.depth = std::numeric_limits<std::uint32_t>::max();
  if (treatment.qos.depth) queue.depth = *treatment.qos.depth;
  // All kept samples of each origin must get through at once when demand begins.
  if (latched > 0) {
    queue.depth = std::max({queue.depth, of_all(latched, history_depth), options.default_depth});
    queue.queue_bytes_max = std::max(queue.queue_bytes_max, options.history_bytes_max);
  }
  if (keep_all) queue.depth = 0;
  return queue;
}

TopicTraits traits_of(const Origins& origins, bool has_header, const Treatment& treatment) {
  TopicTraits traits;
  traits.has_header = has_header;
  traits.best_effort = true;
  for (const auto& [gid, origin] : origins) {
    const Qos qos = qos_to_offer(origin.qos, treatment.qos);
    traits.best_effort = traits.best_effort && qos.reliability == Reliability::kBestEffort;
    traits.keep_all = traits.keep_all || qos.history == History::kKeepAll;
    // The depth that a late subscriber would get (history_depth); 0: unknown.
    const auto kept = [](std::uint32_t depth) { return depth == 0 ? kUnknownDepth : depth; };
    if (qos.durability == Durability::kTransientLocal)
      traits.latched = std::max({traits.latched, kept(qos.depth), kept(origin.qos.depth)});
  }
  return traits;
}

// ---- the mirror

Qos mirror_qos(const Qos& origin, const QosOverride& ruled, const TopicOptions& options) {
  // The depth that a peer requests has a limit. Without it a transient-local mirror would keep all
  // samples of the peer. Any other mirror would block the loop for a subscriber that takes none.
  const std::uint32_t depth_max = options.mirror_depth_max;
  const bool keep_all = origin.history == History::kKeepAll;
  Qos qos = origin;
  qos.depth = keep_all ? depth_max : std::min(qos.depth, depth_max);
  qos.history = History::kKeepLast;
  // The operator's rule comes after the limits for peers, and may request more.
  qos = with_override(qos, ruled);
  const bool latched = qos.durability == Durability::kTransientLocal;
  if (qos.depth == 0) qos.depth = latched ? options.latched_depth : options.default_depth;
  for (Duration* period : {&qos.deadline, &qos.lifespan, &qos.liveliness_lease})
    *period = std::max(*period, kPeriodMin);
  return qos;
}

bool may_resume(const Qos& origin, const Qos& mirror) {
  return origin.reliability == Reliability::kReliable &&
         origin.durability == Durability::kVolatile && mirror.reliability == Reliability::kReliable;
}

}  // namespace connect_bridge
