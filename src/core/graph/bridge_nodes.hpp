// The endpoints of a graph that belong to other bridges, as far as the graph shows that.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <string>

#include "core/graph/graph_view.hpp"

namespace connect_bridge {

// Finds the endpoints of bridges. A node's name may appear in the graph later than its endpoints.
// In DDS the first 12 bytes of a gid identify the participant at once (RTPS 2.3 section 8.2.4).
class BridgeNodes {
 public:
  // Collects all bridges before the first endpoint is judged: the topics of a snapshot have no
  // order that would show bridges first.
  explicit BridgeNodes(const GraphChanged& graph) {
    for (const TopicState& topic : graph.topics)
      if (topic.name == kClaimsTopic)
        for (const Endpoint& publisher : topic.publishers) add(publisher);
  }
  // True for an Endpoint or a Server of a bridge. The gid may be unknown (all zero).
  [[nodiscard]] bool own(const auto& endpoint) const {
    return names_.contains(node_of(endpoint)) ||
           (endpoint.gid != Gid{} && participants_.contains(participant_of(endpoint.gid)));
  }
  [[nodiscard]] bool empty() const { return names_.empty() && participants_.empty(); }

  using Participant = std::array<std::uint8_t, 12>;
  static Participant participant_of(const Gid& gid) {
    Participant participant;
    std::copy_n(gid.bytes.begin(), participant.size(), participant.begin());
    return participant;
  }

 private:
  void add(const Endpoint& claims_publisher) {
    if (const std::string node = node_of(claims_publisher); !node.empty()) names_.insert(node);
    if (claims_publisher.gid != Gid{}) participants_.insert(participant_of(claims_publisher.gid));
  }

  std::set<std::string> names_;
  std::set<Participant> participants_;
};

}  // namespace connect_bridge
