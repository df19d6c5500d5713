// The local graph and what other bridges in it claim, kept in step with each other.
#pragma once

#include <optional>
#include <unordered_set>
#include <vector>

#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"
#include "core/graph/new_publishers.hpp"

namespace connect_bridge {

// Single-threaded; owned by the side.
class LocalGraph {
 public:
  // `own` is our side's id.
  explicit LocalGraph(Token128 own) : claims(own) {}

  void update(GraphChanged picture, const Now& now);
  // What is claimed has changed. True: publishers are no longer of nodes.
  bool on_claims() { return view.hide(claims.mirrors()); }
  // True: publishers that were held back are in the view now, or such that had left before are not
  // in it any longer. To be called until it is false: each is then seen by whoever looks.
  bool release(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;

  GraphView view;
  Claims claims;

 private:
  NewPublishers new_publishers_;
  std::unordered_set<Gid> left_;  // in the view, though they are not in the graph
};

}  // namespace connect_bridge
