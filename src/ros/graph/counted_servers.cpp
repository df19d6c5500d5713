#include "ros/graph/counted_servers.hpp"

#include <algorithm>

namespace connect_bridge::ros {
namespace {

const NodeName& likely_owner(const std::string& service, const std::set<NodeName>& names) {
  const auto likely = std::find_if(names.begin(), names.end(), [&](const NodeName& name) {
    return service.starts_with(full_name(name) + "/");
  });
  return likely == names.end() ? *names.begin() : *likely;
}

}  // namespace

std::string full_name(const NodeName& node) {
  return node.name_space == "/" ? "/" + node.name : node.name_space + "/" + node.name;
}

void add_counted_owners(ServiceOwners& owners, const std::map<std::string, CountedService>& counted,
                        const std::map<std::string, std::size_t>& ours,
                        const std::set<NodeName>& shared) {
  if (shared.empty()) return;
  for (const auto& [service, count] : counted) {
    if (count.types.empty()) continue;
    const auto our = ours.find(service);
    std::size_t known = our == ours.end() ? 0 : our->second;
    bool is_of_shared = false;
    // Two types of one service: the one without an owner is that of the unknown server.
    const std::string* type = nullptr;
    for (const std::string& candidate : count.types) {
      const auto found = owners.find({service, candidate});
      const bool owned = found != owners.end();
      if (!owned || type == nullptr) type = &candidate;
      if (!owned) continue;
      known += found->second.size();
      is_of_shared =
          is_of_shared || std::any_of(found->second.begin(), found->second.end(),
                                      [&](const auto& of) { return shared.contains(of); });
    }
    if (count.servers > known && !is_of_shared)
      owners[{service, *type}].insert(likely_owner(service, shared));
  }
}

}  // namespace connect_bridge::ros
