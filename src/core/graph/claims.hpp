// Which bridge mirrors which origin in the local graph, so that two bridges between the same two
// graphs duplicate nothing. Of several claims that of a bridge that feeds wins: a newcomer would
// take the origin from it, and lose what is published until it has settled. Else the one with the
// smallest side id wins.
#pragma once

#include <string_view>
#include <unordered_map>
#include <unordered_set>

#include "core/base/ids.hpp"
#include "core/graph/claim_message.hpp"

namespace connect_bridge {

// What stands for a mirrored service in a claim: the same 24 bytes in every process.
Gid service_gid(std::string_view service);

// The claims of the other bridges in this graph.
class Claims {
 public:
  explicit Claims(Token128 own) : own_(own) {}

  // `publisher` is the gid of the bridge's publisher on the claims topic. True if anything changed.
  bool update(const Gid& publisher, Claim claim);
  // Forgets the claims of bridges that were in the graph before and are not there now. (A claim may
  // arrive before the first graph snapshot that shows its bridge.) True if anything changed.
  bool retain(const std::unordered_set<Gid>& before, const std::unordered_set<Gid>& now);
  // The bridge of this side id is in our own graph.
  [[nodiscard]] bool is_here(const Token128& side) const;
  // Another bridge mirrors this, whatever its side id.
  [[nodiscard]] bool claimed(const Gid& origin) const { return claimed_.contains(origin); }
  // Another bridge has the better claim to this origin. `feeds`: our own claim says that we feed.
  [[nodiscard]] bool taken(const Gid& origin, bool feeds) const;

 private:
  // The bridges that claim an origin: whether one of them feeds, has a smaller side id than ours,
  // or both.
  struct Others {
    bool feeding = false;
    bool smaller = false;
    bool smaller_feeding = false;
  };

  void rebuild();

  Token128 own_;
  std::unordered_map<Gid, Claim> by_publisher_;
  std::unordered_map<Gid, Others> claimed_;
};

}  // namespace connect_bridge
