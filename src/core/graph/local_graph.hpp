// The local graph and what other bridges in it claim, kept in step with each other.
#pragma once

#include <optional>

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
  // True: publishers that were held back are in the view now.
  bool release(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const { return new_publishers_.deadline(); }

  GraphView view;
  Claims claims;

 private:
  NewPublishers new_publishers_;
};

}  // namespace connect_bridge
