// Topics with which a robot is steered, and what that means for samples that publishers keep.
#pragma once

#include "core/base/qos.hpp"
#include "core/graph/graph_view.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {

// Whether the topic carries commands. Samples that its publishers keep are not asked for: an old
// command would reach a robot that starts or returns as if it were new.
inline bool is_command(const TopicKey& topic) {
  return is_command(topic.first, topic.second);
}

// Whether the last samples of a publisher with this QoS come again when demand begins.
inline bool come_again(const Qos& origin, const TopicKey& topic) {
  return origin.durability == Durability::kTransientLocal && !is_command(topic);
}

}  // namespace connect_bridge
