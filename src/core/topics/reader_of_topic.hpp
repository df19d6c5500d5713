// The QoS that a subscription of a local topic needs.
#pragma once

#include <string>

#include "core/base/qos.hpp"
#include "core/graph/graph_view.hpp"
#include "core/topics/options.hpp"
#include "core/topics/origins.hpp"
#include "core/topics/topic_offers.hpp"

namespace connect_bridge {

// One subscription must match all publishers and lose nothing that any of them keeps. A
// subscription matches a publisher only if it requests no more than the publisher offers, so it
// requests the weakest of what they offer: best effort as soon as one of them is, volatile as soon
// as one of them is (then the samples the others keep do not come, see warn_mixed()). Rules may
// request less, never more: those of links that demand the topic, and those in `weakest`. The depth
// is the largest of all. For listeners alone it is the QoS that matches most publishers.
Qos qos_for(const Origins& origins, const TopicOffers& offers, const QosOverride& weakest,
            const TopicOptions& options);

// Whether the present subscription is good enough for what is wanted now. Creating it again loses
// what volatile publishers send until it is matched, so depth alone is not a reason: samples are
// taken at once. For transient-local publishers depth limits the history that a new subscription
// gets.
inline bool serves(const Qos& present, const Qos& wanted) {
  return present.reliability == wanted.reliability && present.durability == wanted.durability &&
         (wanted.durability == Durability::kVolatile || wanted.depth <= present.depth);
}

// Whether a subscription with this QoS gets all messages, and none that publishers keep: only such
// ones can be sent again after a break.
inline bool may_resume(const Qos& subscription) {
  return subscription.reliability == Reliability::kReliable &&
         subscription.durability == Durability::kVolatile;
}

// Whether a subscription with a listener's type hash fits its publishers. Without a hash the name
// of the type is enough.
inline bool is_hash_of(const std::string& told, const std::string& published) {
  return told.empty() || told == published;
}

// Whether a local endpoint has the topic's name with another type.
inline bool has_other_type(const GraphView& graph, const TopicKey& topic) {
  const auto& topics = graph.topics();
  for (auto it = topics.lower_bound({topic.first, ""});
       it != topics.end() && it->first.first == topic.first; ++it)
    if (it->first.second != topic.second) return true;
  return false;
}

}  // namespace connect_bridge
