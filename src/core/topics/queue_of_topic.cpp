#include "core/topics/queue_of_topic.hpp"

#include <algorithm>
#include <limits>

namespace connect_bridge {

bool is_clock(const TopicKey& key) {
  return key.first == "/clock" && key.second == "rosgraph_msgs/msg/Clock";
}

Priority priority_of(const TopicKey& key, const Treatment& treatment) {
  return treatment.priority.value_or(default_priority(key.first, key.second));
}

QueueOptions queue_of(const TopicKey& key, const Origins& origins, std::uint64_t history_depth,
                      const Treatment& treatment, const TopicOptions& options) {
  QueueOptions queue;
  queue.priority = priority_of(key, treatment);
  queue.may_be_light = !treatment.priority && queue.priority != Priority::kUrgent &&
                       queue.priority != Priority::kBulk;
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
  bool keep_all = false;
  std::uint32_t latched = 0;
  for (const auto& [gid, origin] : origins) {
    const Qos qos = with_override(origin.qos, treatment.qos);
    depth = std::max(depth, qos.depth);
    keep_all = keep_all || qos.history == History::kKeepAll;
    if (qos.durability == Durability::kTransientLocal) ++latched;
    queue.lifespan = std::max(queue.lifespan, qos.lifespan);
  }
  const std::uint32_t untold = options.default_depth;
  queue.depth = depth > 0 ? depth : untold;
  // Several origins share the queue of a transient-local topic, and all that is kept of each must
  // get through at once when demand begins.
  if (latched > 0) {
    constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
    const auto all = std::min(std::uint64_t{latched} * history_depth, kMost);
    queue.depth = std::max(static_cast<std::uint32_t>(all), untold);
    queue.queue_bytes_max = std::max(queue.queue_bytes_max, options.history_bytes_max);
  }
  if (keep_all) queue.depth = 0;
  return queue;
}

}  // namespace connect_bridge
