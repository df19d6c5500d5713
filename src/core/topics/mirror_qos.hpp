// The QoS of a mirror.
#pragma once

#include "core/policy/treatment.hpp"
#include "core/topics/options.hpp"

namespace connect_bridge {

// The QoS for the mirror of an origin with this QoS, by the rule and within what a peer may ask
// for.
[[nodiscard]] Qos mirror_qos(const Qos& origin, const QosOverride& ruled,
                             const TopicOptions& options);

// Whether what is kept for a lost link reaches the subscribers of such a mirror.
[[nodiscard]] bool may_resume(const Qos& origin, const Qos& mirror);

inline bool is_transient_local(const Qos& qos) {
  return qos.durability == Durability::kTransientLocal;
}

}  // namespace connect_bridge
