// Which bridge mirrors what in the local graph, so that two bridges between the same two graphs
// duplicate nothing: who claims first keeps it while its claim is fresh. Of several that claim at
// once, before they have heard each other, the one with the smallest side id keeps it.
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
// choose two names with the same id.
Gid service_gid(std::string_view service);

// The claims of the other bridges in this graph, by the ids of their sides: nothing here depends on
// what a middleware shows of a sample's publisher. Single-threaded.
class Claims {
 public:
  explicit Claims(Token128 own) : own_(own) {}

  // `publisher`: the gid of the bridge's publisher on the claims topic; all zero: not known. True
  // if anything has changed; a claim that is only renewed changes nothing. A claim that is good for
  // no time is the last one of its bridge.
  bool update(const Gid& publisher, Claim claim, TimePoint now);
  // Ends the claims of bridges that were in the graph before and are not there now. (A claim may
  // arrive before the first graph snapshot that shows its bridge.)
  void retain(const std::unordered_set<Gid>& before, const std::unordered_set<Gid>& after,
              TimePoint now);
  // Ends the claims of bridges that have been silent for too long, and forgets what the graph does
  // not show any longer. True if that changes what is claimed or serves() says.
  bool expire(TimePoint now);
  // When expire() is to be called at the latest.
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  // There is another bridge in our graph.
  [[nodiscard]] bool any() const { return !by_side_.empty(); }
  // The bridge of this side id is in our own graph.
  [[nodiscard]] bool is_here(const Token128& side) const { return by_side_.contains(side); }
  // This origin is another bridge's to mirror. `ours`: this side claims it, too.
  [[nodiscard]] bool taken(const Gid& origin, bool ours) const {
    return is_taken(origins_, origin, ours);
  }
  // As taken(), for a service (service_gid).
  [[nodiscard]] bool service_taken(const Gid& service, bool ours) const {
    return is_taken(services_, service, ours);
  }
  // Whether a server of this service (service_gid) may be another bridge's mirror: a bridge claims
  // the service, or did until just now, and the graph may show its server for a moment longer.
  [[nodiscard]] bool serves(const Gid& service) const {
    return services_.contains(service) || served_.contains(service);
  }
  // The publishers here that are other bridges' mirrors, as they say. One that a bridge has ended
  // stays for a moment: the graph may show it longer.
  [[nodiscard]] const std::unordered_set<Gid>& mirrors() const { return mirrors_; }

 private:
  struct Bridge {
    Claim claim;
    Gid publisher;
    std::optional<TimePoint> ends;  // without a sign of life; none: never
  };
  using SmallerOf = std::unordered_map<Gid, bool>;  // whether a smaller side than ours claims it

  void rebuild();
  [[nodiscard]] static bool is_taken(const SmallerOf& claimed, const Gid& gid, bool ours) {
    const auto it = claimed.find(gid);
    return it != claimed.end() && (!ours || it->second);  // mutant: claims_first
  }
  // Remembers what the claim named and `next` does not name, because the graph may show it for a
  // moment longer. `silent`: the bridge has not announced its end.
  void end(const Claim& claim, const Claim& next, bool silent, TimePoint now);

  Token128 own_;
  std::map<Token128, Bridge> by_side_;
  SmallerOf origins_;
  SmallerOf services_;
  std::unordered_set<Gid> mirrors_;
  std::deque<std::pair<TimePoint, Gid>> ended_;  // mirrors, until when the graph may show them
  std::unordered_map<Gid, TimePoint> served_;    // services that ended, in the same way
  std::optional<TimePoint> served_ends_;         // when the first of them is to be forgotten
};

}  // namespace connect_bridge
