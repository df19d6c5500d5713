// Bridges that may be in the graph of a peer: it waits for their claims before it feeds.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "core/graph/claims.hpp"
#include "core/link/link.hpp"

namespace connect_bridge {

// The sides at the other ends of the open links, as far as they have said where they are.
[[nodiscard]] std::vector<ClaimedPeer> peers_of(const LinkTable& links);

// What each peer is told of its neighbours. Two clients that start together do not know of each
// other, but whom they dial does; so the one that comes later is told of the other, which need not
// wait. Single-threaded; owned by the side.
class Neighbours {
 public:
  // What peers are told again takes so long at least.
  static constexpr Duration kPause = std::chrono::seconds(1);

  // Links, what peers accept, or other bridges have changed.
  void change() { changed_ = true; }
  // Those of the peer: it is told of them now.
  std::vector<Token128> tell(const Link& link, const LinkTable& links, const Claims& claims,
                             const Now& now);
  // The links whose peers are to be told again: of others, or that they were told of too many.
  [[nodiscard]] std::vector<Link*> take_due(LinkTable& links, Claims& claims, const Now& now);
  // What the peer was told is gone with the connection.
  void on_link_lost(LinkId link);
  [[nodiscard]] std::optional<TimePoint> deadline() const { return due_; }

 private:
  struct Told {
    std::vector<Token128> sides;
    bool answered = false;  // since it is known where the peer is
    TimePoint free_at{};
  };
  std::map<LinkId, Told> told_;
  bool changed_ = false;
  std::optional<TimePoint> due_;
};

}  // namespace connect_bridge
