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

// "/fleet/talker".
[[nodiscard]] std::string full_name(const NodeName& node);

// Participants of the graph in which bridges live, by the beginning of their endpoints' ids.
// All their endpoints belong to the bridge, whatever nodes they have. Empty where ids do not show
// this (middleware.hpp).
struct BridgeParticipants {
  std::map<Gid, NodeName> others;  // bridges, which publish claims
  // With our node's name: another process, or the remains of a killed one.
  std::set<Gid> namesakes;

  [[nodiscard]] bool empty() const { return others.empty() && namesakes.empty(); }
  // Bridges have proxy nodes under the names of others. For the core, every endpoint of a bridge
  // belongs to the node that publishes its claims, which is put in the place of its own. False: it
  // is a namesake's.
  [[nodiscard]] bool attribute(const Gid& gid, std::string& name_space, std::string& name) const;
};

// All nodes, also those of one name; nullopt: the middleware failed.
std::optional<std::vector<NodeName>> names_of_nodes(const Node& node);

// All services with the servers of others; nullopt: the middleware failed. The servers of `watched`
// services have their ids. `between` is called before each long question.
std::optional<std::vector<ServiceState>> read_services(
    const Node& node, const std::set<std::string>& watched, const BridgeParticipants& bridges,
    const std::function<void()>& between = [] {});

// The services that a node of others has a client of and that nobody serves: neither `served`,
// which are all that others serve, nor this process. At most some hundred. `between` is called
// before each long question. None if the middleware fails.
std::vector<CalledService> read_called(const Node& node, const std::vector<ServiceState>& served,
                                       const std::function<void()>& between);

}  // namespace connect_bridge::ros
