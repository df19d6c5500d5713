#include "core/graph/local_graph.hpp"

#include <utility>

namespace connect_bridge {

void LocalGraph::update(GraphChanged picture, const Now& now) {
  const auto bridges_before = view.bridges();
  new_publishers_.hold(picture, claims.misses(), now);
  view = GraphView(std::move(picture), claims.mirrors());
  view.add_local(new_publishers_.held());
  claims.retain(bridges_before, view.bridges());
}

bool LocalGraph::release(const Now& now) {
  auto due = new_publishers_.take_due(now);
  if (due.empty()) return false;
  view.add(std::move(due), claims.mirrors());
  return true;
}

}  // namespace connect_bridge
