// The ROS graph as a value.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "core/ports/ports.hpp"
#include "ros/node/node.hpp"

namespace connect_bridge::ros {

// All topics with the endpoints of others, and all services with the servers of others; nullopt:
// the middleware failed. The servers of `watched` services have their ids. `unknown_names` is set
// if an endpoint's node is not known yet; it becomes known soon, without a further event.
std::optional<GraphChanged> read_graph(const Node& node, const std::set<std::string>& watched,
                                       bool& unknown_names);

}  // namespace connect_bridge::ros
