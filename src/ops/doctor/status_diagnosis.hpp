// From the status of a running program to causes: for `ctl doctor`. Pure functions of values.
#pragma once

#include <vector>

#include "core/base/json.hpp"
#include "ops/doctor/findings.hpp"

namespace connect_bridge {

// A running side or relay, by its status (docs/status.md).
[[nodiscard]] std::vector<Found> diagnose_status(const Json& status);
// Whether something crosses: then the graph of the side is the right one, whatever this shell has.
[[nodiscard]] bool carries_data(const Json& status);

}  // namespace connect_bridge
