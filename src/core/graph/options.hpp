// Options for the appearance of a side in its graph.
#pragma once

#include <cstddef>
#include <string>

#include "core/policy/interface.hpp"
#include "core/policy/names.hpp"
#include "core/policy/pattern.hpp"

namespace connect_bridge {

// Options for the appearance of imported topics and services in the local graph, and for what its
// changes may cost.
struct GraphOptions {
  bool proxy_nodes = false;  // mirrors belong to a node with their origin's name, not to our own
  bool qos_must_fit = true;  // false: a subscriber receives messages whatever QoS it requests
  // In one step: offers to links, offers that end with their publishers or servers, and reports of
  // subscribed topics.
  std::size_t offers_at_once = 128;
  std::size_t offer_ends_at_once = 256;
  std::size_t listeners_at_once = 1024;

  // The local node that owns the mirror of an endpoint of the peer's `node` (a name on the wire).
  // Empty: our own node.
  [[nodiscard]] std::string owner_of(const std::string& node, const NameMap& names) const {
    return proxy_nodes && is_canonical_name(node) ? names.to_local(node) : std::string();
  }
};

}  // namespace connect_bridge
