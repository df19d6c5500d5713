// The owners of services' servers where the middleware shows no ids of them (middleware.hpp).
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace connect_bridge::ros {

struct NodeName {
  std::string name_space, name;
  auto operator<=>(const NodeName&) const = default;
};

// "/fleet/talker".
std::string full_name(const NodeName& node);

// The nodes that own servers, by the service's name and type.
using ServiceOwners = std::map<std::pair<std::string, std::string>, std::set<NodeName>>;

// A service as the graph counts it.
struct CountedService {
  std::vector<std::string> types;
  std::size_t servers = 0;
};

// Adds the owners of servers that are counted but neither ours nor in `owners`. They belong to a
// name in `shared`, the names that more than one node has: for such a name the middleware shows the
// services of any one of its nodes. A service of such a node has a name below the node's, or
// belongs to the first of them. A service that one of `shared` is known to own gets no more: its
// other servers are most likely its namesake's. `ours`: the most servers of ours during the
// reading, by service.
void add_counted_owners(ServiceOwners& owners, const std::map<std::string, CountedService>& counted,
                        const std::map<std::string, std::size_t>& ours,
                        const std::set<NodeName>& shared);

}  // namespace connect_bridge::ros
