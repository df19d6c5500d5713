// The services of the ROS graph and their owners.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/ports/ports.hpp"
#include "ros/node/node.hpp"

namespace connect_bridge::ros {

struct NodeName {
  std::string name_space, name;
  auto operator<=>(const NodeName&) const = default;
};

// The full name, "/fleet/talker".
[[nodiscard]] std::string full_name(const NodeName& node);

// Participants in which bridges live, by the beginning of their endpoints' ids. All endpoints of
// such a participant belong to the bridge, whatever their nodes. Empty if ids do not show the
// participant (middleware.hpp).
struct BridgeParticipants {
  std::map<Gid, NodeName> others;  // bridges, which publish claims
  // Participants with our node's name: another process, or the remains of a killed one.
  std::set<Gid> namesakes;

  [[nodiscard]] bool empty() const { return others.empty() && namesakes.empty(); }
  // Replaces the node of a bridge's endpoint by the node that publishes the bridge's claims.
  // Bridges have proxy nodes under the names of others, which the core must not see. False: the
  // endpoint is a namesake's.
  [[nodiscard]] bool attribute(const Gid& gid, std::string& name_space, std::string& name) const;
};

// All nodes, with one entry per node of a shared name; nullopt: the middleware failed.
std::optional<std::vector<NodeName>> names_of_nodes(const Node& node);

// All services with the servers of others; nullopt: the middleware failed. Servers of `watched`
// services have their ids. `between` is called before each long question.
std::optional<std::vector<ServiceState>> read_services(
    const Node& node, const std::set<std::string>& watched, const BridgeParticipants& bridges,
    const std::function<void()>& between = [] {});

// Services that somebody else has a client of and nobody serves: neither `served`, which lists all
// services of others, nor this process; and services of this process that have several types. At
// most some hundred. `between` is called before each long
// question. Empty if the middleware fails.
std::vector<CalledService> read_called(const Node& node, const std::vector<ServiceState>& served,
                                       const std::function<void()>& between);

}  // namespace connect_bridge::ros
