#include "core/topics/queue_of_topic.hpp"

#include <algorithm>
#include <limits>

#include "core/topics/command.hpp"

namespace connect_bridge {

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
  // A limit of the operator is one for bursts, too. Without it a burst may have what the link
  // allows one channel (Outbox::add_channel).
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
  // The origins share the queue: what one of them says must not take the place of another's.
  const auto of_all = [](std::uint64_t count, std::uint64_t depth_of_each) {
    constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
    return static_cast<std::uint32_t>(std::min(count * depth_of_each, kMost));
  };
  // A reliable publisher that keeps few may say more at once, and all of it would arrive in one
  // graph. Of commands the newest counts. Not every middleware tells the depth.
  const bool wants_more = (reliable && !drives(treatment, key)) || depth == 0;
  queue.depth = of_all(origins.size(), depth);
  if (wants_more) queue.depth = std::max(queue.depth, options.default_depth);
  // Where each message counts, bytes and kWaitMax bound what waits: the depth that a publisher asks
  // for is meant for a local graph.
  if (keep == Keep::kAll) queue.depth = std::numeric_limits<std::uint32_t>::max();
  if (treatment.qos.depth) queue.depth = *treatment.qos.depth;
  // All that is kept of each must get through at once when demand begins.
  if (latched > 0) {
    queue.depth = std::max({queue.depth, of_all(latched, history_depth), options.default_depth});
    queue.queue_bytes_max = std::max(queue.queue_bytes_max, options.history_bytes_max);
  }
  if (keep_all) queue.depth = 0;
  return queue;
}

// More than one.
constexpr std::uint32_t kUnknownDepth = std::numeric_limits<std::uint32_t>::max();

TopicTraits traits_of(const Origins& origins, bool has_header, const Treatment& treatment) {
  TopicTraits traits;
  traits.has_header = has_header;
  traits.best_effort = true;
  for (const auto& [gid, origin] : origins) {
    const Qos qos = qos_to_offer(origin.qos, treatment.qos);
    traits.best_effort = traits.best_effort && qos.reliability == Reliability::kBestEffort;
    traits.keep_all = traits.keep_all || qos.history == History::kKeepAll;
    // What a late subscriber would get (history_depth); 0: not known.
    const auto kept = [](std::uint32_t depth) { return depth == 0 ? kUnknownDepth : depth; };
    if (qos.durability == Durability::kTransientLocal)
      traits.latched = std::max({traits.latched, kept(qos.depth), kept(origin.qos.depth)});
  }
  return traits;
}

}  // namespace connect_bridge
