// The mirrors of other bridges in the local graph, so that two bridges between the same two graphs
// duplicate nothing. The bridge that claims first keeps the thing while its claim is fresh. If
// several bridges claim before they receive each other's claims, the smallest side id keeps it.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/graph/claim_message.hpp"

namespace connect_bridge {

// The id of a mirrored service in a claim: 24 bytes that depend on its name alone. Nobody can
// choose two names with the same id (SHA-256, truncated).
Gid service_gid(std::string_view service);

// The claims of the other bridges in this graph, by side id. The middleware's publisher of a sample
// does not matter here. Single-threaded.
class Claims {
 public:
  explicit Claims(Token128 own) : own_(own) {}

  // Stores a claim. `publisher`: the gid of the bridge's publisher on the claims topic; all zero:
  // not known. True if anything has changed; a renewed claim changes nothing. A claim with zero
  // validity is the last one of its bridge.
  bool update(const Gid& publisher, Claim claim, TimePoint now);
  // Ends the claims of bridges that were in the graph before and are not there now. A claim may
  // arrive before the first graph snapshot that shows its bridge; such a bridge stays.
  void retain(const std::unordered_set<Gid>& before, const std::unordered_set<Gid>& after,
              TimePoint now);
  // Ends the claims of bridges that were silent for too long, and forgets entries that the graph no
  // longer shows. True if claims or the answer of serves() may have changed.
  bool expire(TimePoint now);
  // The latest time for the next call of expire().
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  // Another bridge is in our graph.
  [[nodiscard]] bool any() const { return !by_side_.empty(); }
  // The bridge of this side id is in our own graph.
  [[nodiscard]] bool is_here(const Token128& side) const { return by_side_.contains(side); }
  // Another bridge mirrors this origin. `ours`: this side claims it, too.
  [[nodiscard]] bool taken(const Gid& origin, bool ours) const {
    return is_taken(origins_, origin, ours);
  }
  // Another bridge mirrors this service (service_gid). `ours`: this side claims it, too.
  [[nodiscard]] bool service_taken(const Gid& service, bool ours) const {
    return is_taken(services_, service, ours);
  }
  // A server of this service (service_gid) may be another bridge's mirror. True while a bridge
  // claims the service, and for a moment longer, since the graph may still show the server.
  [[nodiscard]] bool serves(const Gid& service) const {
    return services_.contains(service) || served_.contains(service);
  }
  // Publishers here that are mirrors of other bridges, by their claims. A mirror stays for a moment
  // after its end, since the graph may still show it.
  [[nodiscard]] const std::unordered_set<Gid>& mirrors() const { return mirrors_; }

 private:
  struct Bridge {
    Claim claim;
    Gid publisher;
    std::optional<TimePoint> ends;  // without a newer claim; none: never
  };
  using SmallerOf = std::unordered_map<Gid, bool>;  // true: a side smaller than ours claims it

  void rebuild();
  [[nodiscard]] static bool is_taken(const SmallerOf& claimed, const Gid& gid, bool ours) {
    const auto it = claimed.find(gid);
    return it != claimed.end() && (!ours || it->second);  // mutant: claims_first
  }
  // Remembers entries of `claim` that `next` omits, because the graph may show them for a moment
  // longer. `silent`: the bridge has not announced its end.
  void end(const Claim& claim, const Claim& next, bool silent, TimePoint now);

  Token128 own_;
  std::map<Token128, Bridge> by_side_;
  SmallerOf origins_;
  SmallerOf services_;
  std::unordered_set<Gid> mirrors_;
  std::deque<std::pair<TimePoint, Gid>> ended_;  // mirrors, and until when the graph may show them
  std::unordered_map<Gid, TimePoint> served_;    // ended services, in the same way
  std::optional<TimePoint> served_ends_;         // when the first of them is forgotten
};

}  // namespace connect_bridge
