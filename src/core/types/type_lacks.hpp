// Types that the peers of a side would get from it, or it from them, if the exporter could take
// them.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"

namespace connect_bridge {

// What has such a type is not offered; the peer is told why, once for each type on a connection.
// Single-threaded.
class TypeLacks {
 public:
  explicit TypeLacks(const SideView& side) : side_(side) {}

  // Tells the peer, which is there and has said what it accepts, what it may have, accepts and was
  // not told of yet. No more than kLacksMax types on a connection; our log names the others too.
  void tell(Link& link);
  void on_link_lost(LinkId link) { told_.erase(link); }
  // The peer lacks these types: the log says so, once for each type and identity.
  void on_told(const Link& link, const std::vector<LackTold>& lacking);

 private:
  // With local names; `part`: the name of a part, for an action.
  struct Found {
    InterfaceKind kind;
    std::string name, part, type, part_type;
    const TypeLack& lack;
  };

  void add(const Found& found, Link& link, std::vector<LackTold>& lacking);

  const SideView side_;
  std::map<LinkId, std::set<std::string>> told_;  // types
};

}  // namespace connect_bridge
