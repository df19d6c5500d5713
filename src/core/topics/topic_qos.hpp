// What follows from the QoS of a topic's publishers: how it is subscribed here, how it waits in the
// queue of a link, and how it is mirrored.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/qos.hpp"
#include "core/flow/queue_options.hpp"
#include "core/graph/graph_view.hpp"
#include "core/policy/interface.hpp"
#include "core/policy/treatment.hpp"
#include "core/topics/options.hpp"
#include "core/topics/origins.hpp"

namespace connect_bridge {

class TopicOffers;

// ---- the subscription here
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

// ---- the queue of a link
// The simulated time of the graph: of it only the newest message is worth anything.
[[nodiscard]] bool is_clock(const TopicKey& key);

// The rule's, else by name and type.
[[nodiscard]] Priority priority_of(const TopicKey& key, const Treatment& treatment);

// What the rule leaves open follows from the QoS of the publishers. `history_depth`: how many
// samples of one publisher a late subscriber here would get.
[[nodiscard]] QueueOptions queue_of(const TopicKey& key, const Origins& origins,
                                    std::uint64_t history_depth, const Treatment& treatment,
                                    Keep keep, const TopicOptions& options);

// What is known of a topic's publishers, after the rule's overrides.
[[nodiscard]] TopicTraits traits_of(const Origins& origins, bool has_header,
                                    const Treatment& treatment);

// ---- the mirror
// The QoS for the mirror of an origin with this QoS, by the rule and within what a peer may ask
// for.
[[nodiscard]] Qos mirror_qos(const Qos& origin, const QosOverride& ruled,
                             const TopicOptions& options);

// Whether what is kept for a lost link reaches the subscribers of such a mirror.
[[nodiscard]] bool may_resume(const Qos& origin, const Qos& mirror);

inline bool is_transient_local(const Qos& qos) {
  return qos.durability == Durability::kTransientLocal;
}

// ---- topics with which a robot is steered
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
