#include "core/graph/local_graph.hpp"

#include <utility>

#include "core/base/timers.hpp"
#include "core/graph/settling.hpp"

namespace connect_bridge {
namespace {

// Service names as claims have them.
std::unordered_set<Gid> shown_services(const GraphChanged& picture) {
  std::unordered_set<Gid> shown;
  for (const ServiceState& service : picture.services)
    if (!service.servers.empty()) shown.insert(service_gid(service.name));
  return shown;
}

}  // namespace

void LocalGraph::update(GraphChanged picture, const Now& now) {
  if (!since_) since_ = now.steady;
  // In this order. The memory of servers that have ended shrinks to those that the picture shows;
  // new publishers are taken out of the picture before it becomes the view, but their ids stay
  // known, as a peer that offers one of them makes a circle; and then claims end whose bridges were
  // in the last view and are not in this one.
  const auto bridges_before = view.bridges();
  if (claims.any_served()) claims.retain_served(shown_services(picture));
  new_publishers_.hold(picture, claims.misses(), now);
  view = GraphView(std::move(picture), claims.mirrors());
  view.add_local(new_publishers_.held());
  left_.clear();
  claims.retain(bridges_before, view.bridges(), now.steady);
}

bool LocalGraph::expect(LinkId link, const std::vector<Token128>& sides, const Now& now) {
  const bool missed = claims.misses();
  // The time counts from the first picture and not from each peer's word: one that names neighbours
  // again and again cannot hold this side up for longer (docs/protocol.md section 7, rule 5).
  const bool too_late = since_ && now.steady >= *since_ + kNeighbourDiscovery;
  claims.expect(link, too_late ? std::vector<Token128>{} : sides);
  return missed != claims.misses();
}

bool LocalGraph::expire(const Now& now) {
  const bool waited = claims.misses() && since_ && now.steady >= *since_ + kNeighbourDiscovery;
  if (waited) claims.expect_nobody();
  const bool expired = claims.expire(now.steady);
  return waited || expired;
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
  const auto first = earliest(new_publishers_.deadline(), claims.deadline());
  if (!claims.misses() || !since_) return first;
  return earliest(first, *since_ + kNeighbourDiscovery);
}

}  // namespace connect_bridge
