// Which bridge mirrors which origin in the local graph, so that two bridges between the same two
// graphs duplicate nothing. Of several claims that of a bridge that feeds wins: a newcomer would
// take the origin from it, and lose what is published until it has settled. Else the one with the
// smallest side id wins.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/graph/claim_message.hpp"

namespace connect_bridge {

// What stands for a mirrored service in a claim: the same 24 bytes in every process.
Gid service_gid(std::string_view service);

// The claims of the other bridges in this graph, by the ids of their sides: nothing here depends on
// what a middleware tells of a sample's publisher. Single-threaded.
class Claims {
 public:
  explicit Claims(Token128 own) : own_(own) {}

  // `publisher`: the gid of the bridge's publisher on the claims topic, all zero where it is not
  // told. True if anything changed; a claim that is only renewed changes nothing. One that is good
  // for no time is a bridge's last.
  bool update(const Gid& publisher, Claim claim, TimePoint now);
  // Forgets the claims of bridges that were in the graph before and are not there now. (A claim may
  // arrive before the first graph snapshot that shows its bridge.) True if anything changed.
  bool retain(const std::unordered_set<Gid>& before, const std::unordered_set<Gid>& now);
  // Forgets the claims of bridges that have been silent for too long. True if anything changed.
  bool expire(TimePoint now);
  // When expire() is to be called at the latest.
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  // There is another bridge in our graph.
  [[nodiscard]] bool any() const { return !by_side_.empty(); }
  // The bridge of this side id is in our own graph.
  [[nodiscard]] bool is_here(const Token128& side) const { return by_side_.contains(side); }
  // Another bridge mirrors this, whatever its side id.
  [[nodiscard]] bool claimed(const Gid& origin) const { return claimed_.contains(origin); }
  // Another bridge has the better claim to this origin. `feeds`: our own claim says that we feed.
  [[nodiscard]] bool taken(const Gid& origin, bool feeds) const;
  // The publishers here that are other bridges' mirrors, as they say. One that a bridge has ended
  // stays for a moment: the graph may show it longer.
  [[nodiscard]] const std::unordered_set<Gid>& mirrors() const { return mirrors_; }
  // The sides at the other ends of the other bridges' links: to whom we are linked as well, may
  // have them in its graph.
  [[nodiscard]] std::set<Token128> peers() const;

  // A peer says that these bridges may be in our graph. Those that are not known here are waited
  // for (core/graph/settling.hpp); no more than 256 in all.
  void expect(const std::vector<Token128>& sides);
  // One of them has never been heard.
  [[nodiscard]] bool misses() const { return !missed_.empty(); }

 private:
  // The bridges that claim an origin: whether one of them feeds, has a smaller side id than ours,
  // or both.
  struct Others {
    bool feeding = false;
    bool smaller = false;
    bool smaller_feeding = false;
  };
  struct Bridge {
    Claim claim;
    Gid publisher;
    std::optional<TimePoint> ends;  // without a sign of life; none: never
  };

  void rebuild();
  // What the claim named is still in the graph for a moment, but for what is `kept`.
  void end_mirrors(const Claim& claim, const std::vector<Gid>& kept, TimePoint now);

  Token128 own_;
  std::map<Token128, Bridge> by_side_;
  std::unordered_map<Gid, Others> claimed_;
  std::unordered_set<Gid> mirrors_;
  std::deque<std::pair<TimePoint, Gid>> ended_;  // mirrors, until when the graph may show them
  std::set<Token128> missed_;
};

}  // namespace connect_bridge
