// Whether a peer publishes this side's ROS time.
#pragma once

#include "core/graph/graph_view.hpp"
#include "core/graph/options.hpp"
#include "core/link/link.hpp"
#include "core/policy/policy.hpp"

namespace connect_bridge {

// A peer that publishes our ROS time needs the time of our graph, that is, of its /clock if there
// is one that the rules let it have. Nothing else uses it, so /clock is followed only then.
[[nodiscard]] bool wants_clock(const LinkTable& links, const GraphView& graph,
                               const GraphOptions& options, const Policy& policy);

}  // namespace connect_bridge
