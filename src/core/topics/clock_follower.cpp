#include "core/topics/clock_follower.hpp"

#include <utility>

#include "core/topics/clock_publisher.hpp"

namespace connect_bridge {

void ClockFollower::update(const LinkTable& links, const GraphView& graph, const Policy& policy,
                           const NameMap& names, Outputs& outputs) {
  bool follows = false;
  for (const auto& [id, link] : links) {
    if (!link.open() || !link.accepts || !link.accepts->ros_time) continue;
    const TopicState* clock = graph.find({"/clock", kClockType});
    const auto wire_name = names.to_wire("/clock");
    follows = follows || (clock && !clock->publishers.empty() && wire_name &&
                          policy.decide(Direction::kExport, InterfaceKind::kTopic, *wire_name,
                                        kClockType, link.identity));
  }
  if (std::exchange(follows_, follows) != follows) outputs.push(FollowClock{follows});
}

}  // namespace connect_bridge
