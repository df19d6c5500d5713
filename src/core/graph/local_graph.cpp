#include "core/graph/local_graph.hpp"

#include <utility>

#include "core/base/timers.hpp"

namespace connect_bridge {
void LocalGraph::update(GraphChanged picture, const Now& now) {
  // In this order. New publishers are taken out of the picture before it becomes the view, but
  // their ids stay known, as a peer that offers one of them makes a circle; and then claims end
  // whose bridges were in the last view and are not in this one.
  const auto bridges_before = view.bridges();
  new_publishers_.hold(picture, now);
  view = GraphView(std::move(picture), claims.mirrors());
  view.add_local(new_publishers_.held());
  left_.clear();
  claims.retain(bridges_before, view.bridges(), now.steady);
}

bool LocalGraph::release(const Now& now) {
  // A publisher that was held back and has left meanwhile is in the view once, so that what it has
  // published can be forwarded, and out of it with the next call.
  if (!left_.empty()) {
    view.remove(left_);
    left_.clear();
    return true;
  }
  auto due = new_publishers_.take_due(now);
  if (due.topics.empty()) return false;
  view.add(std::move(due.topics), claims.mirrors());
  left_ = std::move(due.left);
  return true;
}

std::optional<TimePoint> LocalGraph::deadline() const {
  return earliest(new_publishers_.deadline(), claims.deadline());
}

}  // namespace connect_bridge
