// What a subscription of a local topic must be.
#pragma once

#include <map>
#include <string>

#include "core/base/qos.hpp"
#include "core/graph/graph_view.hpp"
#include "core/topics/options.hpp"
#include "core/topics/origins.hpp"
#include "core/topics/topic_offer.hpp"

namespace connect_bridge {

// One subscription must match all publishers and lose nothing that any of them keeps. A reader
// matches a publisher only if it asks for no more than that offers, so it asks for the weakest of
// what they offer: best effort as soon as one of them is, volatile as soon as one of them is (then
// the samples the others keep do not come, see warn_mixed()). Rules may ask for less, never for
// more. The depth is the largest. For listeners alone it is what serves most publishers.
Qos qos_for(const Origins& origins, const std::map<LinkId, TopicOffer>& offers, bool as_volatile,
            const TopicOptions& options);

// Whether a subscription is good enough for what is wanted now. To make it anew loses what volatile
// publishers send until the graph has matched it, so depth alone is no reason: samples are taken at
// once. Of transient-local publishers it limits the history that comes with the subscription.
inline bool serves(const Qos& present, const Qos& wanted) {
  return present.reliability == wanted.reliability && present.durability == wanted.durability &&
         (wanted.durability == Durability::kVolatile || wanted.depth <= present.depth);
}

// Whether a subscription with the type hash that a listener told is one for its publishers. Without
// any the name of the type has to do.
inline bool is_hash_of(const std::string& told, const std::string& published) {
  return told.empty() || told == published;
}

// Whether somebody here has the topic's name with another type.
inline bool has_other_type(const GraphView& graph, const TopicKey& topic) {
  const auto& topics = graph.topics();
  for (auto it = topics.lower_bound({topic.first, ""});
       it != topics.end() && it->first.first == topic.first; ++it)
    if (it->first.second != topic.second) return true;
  return false;
}

}  // namespace connect_bridge
