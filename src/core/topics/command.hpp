// Topics with which a robot is steered, and what that means for samples that publishers keep.
#pragma once

#include "core/base/qos.hpp"
#include "core/graph/graph_view.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {

// Of such a topic nothing is asked for that a publisher keeps: it would reach, late and as if it
// were new, a robot that starts or returns.
inline bool drives(const Treatment& treatment, const TopicKey& topic) {
  return drives(treatment, topic.first, topic.second);
}

// Whether the last samples of a publisher with this QoS come again when demand begins.
inline bool come_again(const Qos& origin, const Treatment& treatment, const TopicKey& topic) {
  return origin.durability == Durability::kTransientLocal && !drives(treatment, topic);
}

}  // namespace connect_bridge
