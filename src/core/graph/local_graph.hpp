// The local graph and the claims of other bridges in it, kept in step with each other.
#pragma once

#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"

namespace connect_bridge {

// A publisher may be another bridge's mirror under another node's name, and the graph may show it
// before that bridge's claim names it. Samples of that mirror would then return to their own graph.
// So beside another bridge, a publisher counts only a moment after it was first seen; its samples
// are parked meanwhile (core/topics/local_topic.hpp). Nothing waits if ids reveal the process of an
// endpoint.
//
// Single-threaded; owned by the side.
class LocalGraph {
 public:
  // `own` is the id of our side.
  explicit LocalGraph(Token128 own) : claims(own) {}

  GraphDifference update(GraphChanged picture, const Now& now);
  // What is claimed has changed. True: publishers are no longer of nodes.
  bool on_claims() { return view.hide(claims.mirrors()); }
  // True: publishers that were held back are in the view now, or such that had left before are not
  // in it any longer. Subscribers and servers stay as they are, and is_local() knew the publishers.
  // To be called until it is false: each is then seen by whoever looks.
  bool release(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  GraphView view;
  Claims claims;

 private:
  // A publisher that is held back. One that leaves meanwhile stays in the list: its samples are
  // still to be forwarded.
  struct Held {
    TimePoint until;
    TopicState topic;  // with this publisher only
    bool left = false;
    [[nodiscard]] const Gid& gid() const { return topic.publishers.front().gid; }
  };

  // Takes publishers that are too new out of the snapshot.
  void hold(GraphChanged& graph, const Now& now);

  // Publishers of the last snapshot, with the time when one that does not count yet was first seen.
  std::unordered_map<Gid, std::optional<TimePoint>> seen_;
  std::vector<Held> held_;
  std::unordered_set<Gid> left_;  // in the view, but no longer in the graph
};

}  // namespace connect_bridge
