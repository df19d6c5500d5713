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

// What stands for a mirrored service in a claim: the same 24 bytes in every process, and others for
// each name, whoever chooses the names.
Gid service_gid(std::string_view service);

// The claims of the other bridges in this graph, by the ids of their sides: nothing here depends on
// what a middleware shows of a sample's publisher. Single-threaded.
class Claims {
 public:
  explicit Claims(Token128 own) : own_(own) {}

  // `publisher`: the gid of the bridge's publisher on the claims topic, all zero where it is not
  // told. True if anything changed; a claim that is only renewed changes nothing. One that is good
  // for no time is a bridge's last.
  bool update(const Gid& publisher, Claim claim, TimePoint now);
  // Ends the claims of bridges that were in the graph before and are not there now. (A claim may
  // arrive before the first graph snapshot that shows its bridge.) True if anything changed.
  bool retain(const std::unordered_set<Gid>& before, const std::unordered_set<Gid>& after,
              TimePoint now);
  // Ends the claims of bridges that have been silent for too long, and forgets what the graph does
  // not show any longer. True if a claim has changed by that.
  bool expire(TimePoint now);
  // When expire() is to be called at the latest.
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  // There is another bridge in our graph.
  [[nodiscard]] bool any() const { return !by_side_.empty(); }
  // The bridge of this side id is in our own graph.
  [[nodiscard]] bool is_here(const Token128& side) const { return by_side_.contains(side); }
  // Another bridge mirrors this, whatever its side id.
  [[nodiscard]] bool claimed(const Gid& origin) const { return origins_.contains(origin); }
  // The same of a service (service_gid), or another bridge did just now: the graph may show its
  // server for a moment longer.
  [[nodiscard]] bool serves(const Gid& service) const {
    return services_.contains(service) || served_.contains(service);
  }
  // Another bridge claims it, or did and fell silent: its server may be shown, and is no reason not
  // to take over. (One that was ended in order is soon gone, or gave way to a real one.)
  [[nodiscard]] bool is_left_behind(const Gid& service) const {
    const auto it = served_.find(service);
    return services_.contains(service) || (it != served_.end() && it->second.silent);
  }
  // The graph shows that these services of bridges have servers, and no others of those that ended.
  void retain_served(const std::unordered_set<Gid>& shown);
  [[nodiscard]] bool any_served() const { return !served_.empty(); }
  // Another bridge has the better claim to this origin. `feeds`: our own claim says that we feed.
  [[nodiscard]] bool taken(const Gid& origin, bool feeds) const {
    return is_better(origins_, origin, feeds);
  }
  // The same of a service.
  [[nodiscard]] bool service_taken(const Gid& service, bool feeds) const {
    return is_better(services_, service, feeds);
  }
  // The publishers here that are other bridges' mirrors, as they say. One that a bridge has ended
  // stays for a moment: the graph may show it longer.
  [[nodiscard]] const std::unordered_set<Gid>& mirrors() const { return mirrors_; }
  // The sides at the other ends of the other bridges' links. A peer of ours may have them in its
  // graph. `since`: when that was said first; the beginning of time, if it was the
  // first that was heard of the bridge.
  struct FarPeer {
    ClaimedPeer peer;
    TimePoint since;
  };
  [[nodiscard]] std::vector<FarPeer> peers() const;
  // These sides, or the bridges that are here, have changed: true once after every change.
  bool take_peers_change() { return std::exchange(peers_changed_, false); }

  // The peer of this link says now that these bridges may be in our graph. Those that are not known
  // here are waited for (core/graph/settling.hpp).
  void expect(LinkId link, const std::vector<Token128>& sides);
  // They have been waited for long enough.
  void expect_nobody() { missed_.clear(); }
  // One of them has not been heard.
  [[nodiscard]] bool misses() const { return !missed_.empty(); }

 private:
  // The bridges that claim something: whether one of them feeds, has a smaller side id than ours,
  // or both.
  struct Others {
    bool feeding = false;
    bool smaller = false;
    bool smaller_feeding = false;
  };
  using OthersOf = std::unordered_map<Gid, Others>;
  struct Bridge {
    Claim claim;
    Gid publisher;
    std::optional<TimePoint> ends;  // without a sign of life; none: never
    std::map<Token128, TimePoint> peers_since = {};
  };

  void hear(const Token128& side);
  void rebuild();
  static void add(const std::vector<Claimed>& claimed, bool smaller, OthersOf& to);
  [[nodiscard]] static bool is_better(const OthersOf& others, const Gid& gid, bool feeds);
  // What the claim named is still in the graph for a moment, but for what `next` names. `silent`:
  // its bridge has not said that it ends.
  void end(const Claim& claim, const Claim& next, bool silent, TimePoint now);

  // Whether there was any whose time is over.
  bool forget_served(TimePoint now);

  Token128 own_;
  std::map<Token128, Bridge> by_side_;
  OthersOf origins_;
  OthersOf services_;
  std::unordered_set<Gid> mirrors_;
  std::deque<std::pair<TimePoint, Gid>> ended_;  // mirrors, until when the graph may show them
  struct Served {
    TimePoint until;  // the graph may show it
    bool silent = false;
  };
  std::unordered_map<Gid, Served> served_;       // services that ended
  std::optional<TimePoint> served_ends_;         // the first of them
  std::map<LinkId, std::set<Token128>> missed_;  // by whose peer names them; no set is empty
  bool peers_changed_ = false;
};

}  // namespace connect_bridge
