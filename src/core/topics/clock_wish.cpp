#include "core/topics/clock_wish.hpp"

#include <algorithm>

#include "core/topics/clock_publisher.hpp"

namespace connect_bridge {

bool wants_clock(const LinkTable& links, const GraphView& graph, const GraphOptions& options,
                 const Policy& policy) {
  const TopicState* clock = graph.find({"/clock", kClockType});
  const auto wire_name = options.names.to_wire("/clock");
  if (!clock || clock->publishers.empty() || !wire_name) return false;
  return std::any_of(links.begin(), links.end(), [&](const auto& entry) {
    const Link& link = entry.second;
    return link.open() && link.accepts && link.accepts->ros_time &&
           policy.decide(Direction::kExport, InterfaceKind::kTopic, *wire_name, kClockType,
                         link.identity);
  });
}

}  // namespace connect_bridge
