// Types that the peers of a side would get from it, or it from them, if the exporter could take
// them.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>

#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"
#include "core/ports/status.hpp"

namespace connect_bridge {

// What has such a type is not offered; the peer is told why, once for each type on a connection.
// Single-threaded.
class TypeLacks {
 public:
  explicit TypeLacks(const SideView& side) : side_(side) {}

  // Tells the peer, which is there and has said what it accepts, what it may have, accepts and was
  // not told of yet. No more than kLacksMax types on a connection; our log names the others too.
  void tell(Link& link);
  void on_link_lost(LinkId link);
  // The peer lacks these types: the log says so, once for each type and identity. What it offers it
  // does not lack any longer.
  void on_offer(const Link& link, const Offer& offer);

  // What is lacking here and could cross otherwise, and what the peer told and did not offer since.
  void add_status(const Link& link, LinkStatus& status) const;

 private:
  // With local names; `part`: the name of a part, for an action.
  struct Found {
    InterfaceKind kind;
    std::string name, part, type, part_type;
    const TypeLack& lack;
  };
  // By type; each with the local name.
  using Lacking = std::map<std::string, std::pair<std::string, LackTold>>;

  [[nodiscard]] Lacking lacking_for(const Link& link) const;
  void add(const Found& found, const Link& link, Lacking& lacking) const;
  void on_told(const Link& link, const LackTold& told);

  const SideView side_;
  std::map<LinkId, std::set<std::string>> told_;               // types
  std::map<LinkId, std::map<std::string, LackStatus>> heard_;  // at most kLacksMax of each; by type
};

}  // namespace connect_bridge
