// The moment when this side may make a mirror that another bridge of its graph might make as well.
#pragma once

#include <algorithm>
#include <optional>

#include "core/base/time.hpp"

namespace connect_bridge {

// Time after the start in which no topic is claimed: claims that other bridges sent before must
// arrive first. A short time is enough: two mirrors of a topic only repeat each other's samples for
// a while, and most graphs are discovered in this time.
inline constexpr Duration kTopicDiscovery = std::chrono::milliseconds(500);
// The same time for services; two servers of one name would both execute each call. A process may
// discover another one only by the next announcement, which bridges send every 500 ms
// (ros/rcl/fastdds_profile.hpp). One announcement may be lost, and claims follow within 0.4 s on a
// busy machine.
inline constexpr Duration kServiceDiscovery = std::chrono::milliseconds(1500);
// Time from the claim to the mirror beside another bridge. Claims of one thing may cross; all
// bridges but one receive the better claim in this time. Services wait longer, because a loop may
// stand still for a moment when its publishers block.
inline constexpr Duration kTopicSettle = std::chrono::milliseconds(250);
inline constexpr Duration kServiceSettle = std::chrono::seconds(1);
// A claim names a mirror at the latest this long after the graph shows the mirror.
inline constexpr Duration kClaimNames = std::chrono::milliseconds(150);
// The graph shows the node of a publisher within this time, or never. Samples stay parked for
// longer than this (core/topics/local_topic.cpp).
inline constexpr Duration kNodeNames = std::chrono::milliseconds(900);

// Our claim of one origin or service. A value; single-threaded.
class Claiming {
 public:
  // Knowledge about the graph. `settle` counts from the claim; zero while no other bridge is known.
  struct Graph {
    TimePoint discovered;
    Duration settle;
  };
  // Claims the thing. Call it when nothing else keeps the mirror from being made. Returns the time
  // when the mirror may be made; nothing is claimed before `discovered`.
  TimePoint want(const Graph& graph, const Now& now) {
    if (now.steady < graph.discovered) return graph.discovered;  // mutant: claims_start
    if (!settled_at_) settled_at_ = now.steady + graph.settle;   // mutant: claims_cross
    return *settled_at_;
  }
  // Gives up the claim: there is no mirror, and none will be made as things are.
  void give_up() { settled_at_.reset(); }
  [[nodiscard]] bool holds() const { return settled_at_.has_value(); }

 private:
  std::optional<TimePoint> settled_at_;
};

}  // namespace connect_bridge
