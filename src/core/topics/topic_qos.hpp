// The consequences of the QoS of a topic's publishers: for its subscription here, for the queue of
// a link, and for the mirror.
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
// subscription matches a publisher only if it requests no more than the publisher offers. So it
// requests the weakest offer: best effort if one publisher is, and volatile if one is. With a
// volatile publisher the kept samples of the others do not come, see warn_mixed(). Rules may
// request less, never more: those of links that demand the topic, and those in `weakest`. The depth
// is the largest of all. For listeners alone the QoS matches most publishers.
Qos qos_for(const Origins& origins, const TopicOffers& offers, const QosOverride& weakest,
            const TopicOptions& options);

// Does the present subscription serve, so that it need not be made again? A new one loses samples
// of volatile publishers until it is matched, so depth alone is no reason: samples are taken at
// once. For transient-local publishers depth limits the history that a new subscription gets.
inline bool serves(const Qos& present, const Qos& wanted) {
  return present.reliability == wanted.reliability && present.durability == wanted.durability &&
         (wanted.durability == Durability::kVolatile || wanted.depth <= present.depth);
}

// Does a subscription with this QoS get all messages, and none that publishers keep? Only such
// messages can be sent again after a break.
inline bool may_resume(const Qos& subscription) {
  return subscription.reliability == Reliability::kReliable &&
         subscription.durability == Durability::kVolatile;
}

// Does a subscription with a listener's type hash fit its publishers? Without a hash the name of
// the type is enough.
inline bool is_hash_of(const std::string& known, const std::string& published) {
  return known.empty() || known == published;
}

// ---- the queue of a link
// Is this the simulated time of the graph? Only its newest message counts.
[[nodiscard]] bool is_clock(const TopicKey& key);

// The rule's priority, else the default by name and type.
[[nodiscard]] Priority priority_of(const TopicKey& key, const Treatment& treatment);

// The options of the queue. Settings that the rule leaves open follow from the QoS of the
// publishers. `history_depth`: samples of one publisher that a late subscriber here would get.
[[nodiscard]] QueueOptions queue_of(const TopicKey& key, const Origins& origins,
                                    std::uint64_t history_depth, const Treatment& treatment,
                                    Keep keep, const TopicOptions& options);

// Properties of a topic's publishers, after the rule's overrides.
[[nodiscard]] TopicTraits traits_of(const Origins& origins, bool has_header,
                                    const Treatment& treatment);

// ---- the mirror
// The QoS for the mirror of an origin with this QoS, by the rule and within the limits for a peer.
[[nodiscard]] Qos mirror_qos(const Qos& origin, const QosOverride& ruled,
                             const TopicOptions& options);

// Does a message kept for a lost link reach the subscribers of such a mirror?
[[nodiscard]] bool may_resume(const Qos& origin, const Qos& mirror);

inline bool is_transient_local(const Qos& qos) {
  return qos.durability == Durability::kTransientLocal;
}

// ---- topics that drive a robot
// Does the topic drive a robot? Then no kept samples of a publisher are requested. A robot
// that starts or returns would get them late, as if they were new.
inline bool drives(const Treatment& treatment, const TopicKey& topic) {
  return drives(treatment, topic.first, topic.second);
}

// Do the last samples of a publisher with this QoS come again when demand begins?
inline bool come_again(const Qos& origin, const Treatment& treatment, const TopicKey& topic) {
  return origin.durability == Durability::kTransientLocal && !drives(treatment, topic);
}

}  // namespace connect_bridge
