#include "core/graph/local_graph.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "core/base/timers.hpp"
#include "core/graph/bridge_nodes.hpp"
#include "core/graph/claiming.hpp"

namespace connect_bridge {
namespace {

// True if endpoints of one process have ids with a common beginning: then ids reveal a bridge's
// mirrors. Nodes and bridges have several endpoints each, so a snapshot shows this.
bool ids_show_process(const GraphChanged& graph) {
  std::set<BridgeNodes::Participant> seen;
  const auto is_known = [&](const Endpoint& endpoint) {
    return endpoint.gid != Gid{} && !seen.insert(BridgeNodes::participant_of(endpoint.gid)).second;
  };
  return std::any_of(graph.topics.begin(), graph.topics.end(), [&](const TopicState& topic) {
    return std::any_of(topic.publishers.begin(), topic.publishers.end(), is_known) ||
           std::any_of(topic.subscribers.begin(), topic.subscribers.end(), is_known);
  });
}

// The time for which a new publisher is held back.
Duration time_of(const Endpoint& publisher) {
  return node_of(publisher).empty() ? kNodeNames : kClaimNames;
}

}  // namespace

GraphDifference LocalGraph::update(GraphChanged picture, const Now& now) {
  // In this order. New publishers are taken out of the picture before it becomes the view, but
  // their ids stay known, as a peer that offers one of them makes a circle; and then claims end
  // whose bridges were in the last view and are not in this one.
  hold(picture, now);
  const GraphView before = std::exchange(view, GraphView(std::move(picture), claims.mirrors()));
  for (const Held& held : held_) view.add_local(held.gid());
  left_.clear();
  claims.retain(before.bridges(), view.bridges(), now.steady);
  return view.since(before);
}

void LocalGraph::hold(GraphChanged& graph, const Now& now) {
  const BridgeNodes bridges(graph);
  const bool watches = !bridges.empty() && !ids_show_process(graph);
  const auto before = std::exchange(seen_, {});
  auto held_before = std::exchange(held_, {});
  // The time when a publisher that does not count yet was first seen; none: it counts.
  const auto first_seen = [&](const Endpoint& publisher) {
    const auto known = before.find(publisher.gid);
    auto first = watches ? std::optional(now.steady) : std::nullopt;
    if (known != before.end()) first = known->second;
    return first && !bridges.own(publisher) ? first : std::nullopt;
  };
  for (TopicState& topic : graph.topics) {
    if (topic.name == kClaimsTopic) continue;
    std::vector<Endpoint> counting;
    for (Endpoint& publisher : topic.publishers) {
      // A publisher without a time counts. A publisher of the last snapshot continues to count,
      // even if the first other bridge has come since: it was here before.
      auto& first = seen_[publisher.gid] = first_seen(publisher);
      const TimePoint until = first ? *first + time_of(publisher) : now.steady;
      if (until > now.steady) {
        held_.push_back({until,
                         {topic.name,
                          topic.type,
                          topic.type_hash,
                          {publisher},
                          {},
                          topic.lack,
                          topic.has_header}});
      } else {
        first.reset();
        counting.push_back(std::move(publisher));
      }
    }
    topic.publishers = std::move(counting);
  }
  // `ros2 topic pub --once` may leave before its publisher counts. The samples are parked, and are
  // forwarded when the time is over.
  for (Held& held : held_before) {
    if (seen_.contains(held.gid())) continue;
    held.left = true;
    held_.push_back(std::move(held));
  }
}

bool LocalGraph::release(const Now& now) {
  // A publisher that has left while it was held back is in the view once, so that its samples can
  // be forwarded. The next call removes it.
  if (!left_.empty()) {
    view.remove(left_);
    left_.clear();
    return true;
  }
  std::vector<TopicState> due;
  std::erase_if(held_, [&](Held& held) {
    if (held.until > now.steady) return false;
    if (held.left) left_.insert(held.gid());
    due.push_back(std::move(held.topic));
    return true;
  });
  if (due.empty()) return false;
  view.add(std::move(due), claims.mirrors());
  return true;
}

std::optional<TimePoint> LocalGraph::deadline() const {
  std::optional<TimePoint> first = claims.deadline();
  for (const Held& held : held_) first = earliest(first, held.until);
  return first;
}

}  // namespace connect_bridge
