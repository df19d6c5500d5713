// The local graph and what other bridges in it claim, kept in step with each other.
#pragma once

#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"

namespace connect_bridge {

// A publisher may be another bridge's mirror under another node's name, and the graph may show it
// before its bridge's claim names it. If it were exported until then, what it publishes would come
// back to where it was published. So beside another bridge a publisher counts only a moment after
// it was seen first; what it publishes meanwhile is parked (core/topics/local_topic.hpp). Where
// ids show which process an endpoint belongs to, nothing waits.
//
// Single-threaded; owned by the side.
class LocalGraph {
 public:
  // `own` is our side's id.
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
  // One that leaves meanwhile is held all the same: what it has published is still to cross.
  struct Held {
    TimePoint until;
    TopicState topic;  // with this publisher alone
    bool left = false;
    [[nodiscard]] const Gid& gid() const { return topic.publishers.front().gid; }
  };

  // Takes those that are too new out of the picture.
  void hold(GraphChanged& graph, const Now& now);

  // The publishers of the last picture, and when one that does not count yet was seen first.
  std::unordered_map<Gid, std::optional<TimePoint>> seen_;
  std::vector<Held> held_;
  std::unordered_set<Gid> left_;  // in the view, though they are not in the graph
};

}  // namespace connect_bridge
