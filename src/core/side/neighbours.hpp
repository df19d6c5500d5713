// Bridges that may be in the graph of a peer: it waits for their claims before it feeds.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <vector>

#include "core/graph/claims.hpp"
#include "core/graph/settling.hpp"
#include "core/link/link.hpp"

namespace connect_bridge {

// The sides at the other ends of the open links, as far as it is known where they are.
[[nodiscard]] std::vector<ClaimedPeer> peers_of(const LinkTable& links);

// The neighbours that each peer is sent. Two clients that start together do not know of each other,
// but the server that they dial does: it names the earlier one to the later one, and the earlier
// one need not wait. All links are looked at twice for each connection, when it opens and when its
// peer has said where it is; what changes later is looked at once a second, for the peers that may
// still wait. Single-threaded; owned by the side.
class Neighbours {
 public:
  // The least time between two updates to peers.
  static constexpr Duration kPause = std::chrono::seconds(1);
  // Longer after its connection a peer waits for nobody: its graph has been discovered, but for the
  // time from its connection to its first look at the graph.
  static constexpr Duration kWaits = kNeighbourDiscovery + std::chrono::milliseconds(1500);

  // Those of the peer: they are sent to it now.
  [[nodiscard]] std::vector<Token128> tell(const Link& link, const LinkTable& links,
                                           const Claims& claims, const Now& now);
  // The peer has said where it is. True: its neighbours are others than those that it was sent, and
  // are to be sent now.
  [[nodiscard]] bool locate(const Link& link, const LinkTable& links, const Claims& claims,
                            const Now& now);
  // The links whose peers have more neighbours by now.
  [[nodiscard]] std::vector<Link*> take_due(LinkTable& links, Claims& claims, const Now& now);
  // What the peer was sent is gone with the connection.
  void on_link_lost(LinkId link) { told_.erase(link); }
  [[nodiscard]] std::optional<TimePoint> deadline() const { return due_; }

 private:
  struct Told {
    std::set<Token128> sides;
    // Links that the peer may have had before it was started again, unless they live.
    std::vector<LinkId> elders;
  };

  Told& look(const Link& link, const LinkTable& links, const Claims& claims, const Now& now);
  static bool take_living(Told& told, const Link& link, const LinkTable& links,
                          const Claims& claims);

  std::map<LinkId, Told> told_;  // of peers that may still wait
  std::optional<TimePoint> due_;
  TimePoint free_at_{};
};

}  // namespace connect_bridge
