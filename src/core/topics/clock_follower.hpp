// Whether this side needs the ROS time of its graph.
#pragma once

#include "core/graph/graph_view.hpp"
#include "core/graph/options.hpp"
#include "core/link/link.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// A peer that publishes our ROS time needs the time of our graph, that is, of its /clock if there
// is one. Nothing else uses it, so /clock is followed only then. Single-threaded.
class ClockFollower {
 public:
  // To be called after every input.
  void update(const LinkTable& links, const GraphView& graph, const Policy& policy,
              const NameMap& names, Outputs& outputs);

 private:
  bool follows_ = false;
};

}  // namespace connect_bridge
