// When this side may make a mirror that another bridge of its graph might make as well.
#pragma once

#include <algorithm>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge {

// Nothing is claimed before the claims that are under way when a process starts have arrived. Two
// topics would only repeat each other's samples for a while, and mostly a graph is discovered in
// this time.
inline constexpr Duration kTopicDiscovery = std::chrono::milliseconds(500);
// Two servers of one name would both execute each call: at times a process knows another one only
// when that announces itself again, and bridges do so every 500 ms (ros/rcl/fastdds_profile.hpp).
// Beside the time until claims have followed, up to 0.4 s on a busy machine, one may be lost.
inline constexpr Duration kServiceDiscovery = std::chrono::milliseconds(1500);
// Beside another bridge, from the claim to the mirror: claims of the same thing cross, and of those
// who claim at once all but one hear that in time. For services also where a loop stands still for
// a moment, as its publishers may block.
inline constexpr Duration kTopicSettle = std::chrono::milliseconds(250);
inline constexpr Duration kServiceSettle = std::chrono::seconds(1);
// Within this time a claim names a mirror that the graph shows.
inline constexpr Duration kClaimNames = std::chrono::milliseconds(150);
// The graph shows the node of a publisher within this time, or never. Shorter than its samples are
// parked (core/topics/local_topic.cpp).
inline constexpr Duration kNodeNames = std::chrono::milliseconds(900);

// Our claim of one origin or service. A value; single-threaded.
class Claiming {
 public:
  // What is known of the graph. `settle`: from the claim on; zero while no other bridge is known.
  struct Graph {
    TimePoint discovered;
    Duration settle;
  };
  // A mirror could be made now, but for this. When it may be made; before `discovered` nothing is
  // claimed.
  TimePoint want(const Graph& graph, const Now& now) {
    if (now.steady < graph.discovered) return graph.discovered;  // mutant: claims_start
    if (!settled_at_) settled_at_ = now.steady + graph.settle;   // mutant: claims_cross
    return *settled_at_;
  }
  // There is no mirror, and none will be made as things are.
  void give_up() { settled_at_.reset(); }
  [[nodiscard]] bool holds() const { return settled_at_.has_value(); }

 private:
  std::optional<TimePoint> settled_at_;
};

}  // namespace connect_bridge
