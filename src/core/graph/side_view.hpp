// The parts of a side that its topics and services share.
#pragma once

#include <string>

#include "core/graph/actions.hpp"
#include "core/graph/claims.hpp"
#include "core/graph/graph_view.hpp"
#include "core/graph/options.hpp"
#include "core/jobs/jobs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// All parts outlive whoever has this view.
struct SideView {
  const GraphOptions& graph_options;
  const Policy& policy;
  const GraphView& graph;
  const Claims& claims;
  const LocalActions& actions;
  Jobs& jobs;
  Outputs& outputs;

  // Another bridge is known to be in this graph.
  [[nodiscard]] bool beside_bridges() const { return claims.any() || !graph.bridges().empty(); }
};

}  // namespace connect_bridge
