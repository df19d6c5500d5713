// From the status of a running program to causes: for `ctl doctor`. Pure functions of values.
// One unit: the conditions, of a side, its links and what crosses them, share the side's facts.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "core/base/json.hpp"
#include "ops/doctor/findings.hpp"

namespace connect_bridge {

// What the parameters of a running side say, as far as they are known.
struct SideFacts {
  bool may_export = true;              // some rule lets something out
  std::uint64_t bytes_per_second = 0;  // the limit that somebody has set; 0: none
  std::vector<std::string> expired =
      {};  // server: identities of which no token is valid any longer
};

// A running side or relay, by its status (docs/status.md).
[[nodiscard]] std::vector<Found> diagnose_status(const Json& status, const SideFacts& facts = {});
// The topics that a side brings into its graph, by the messages of the last minutes.
[[nodiscard]] std::set<std::string> brought_topics(const Json& status);
// Whether something crosses: then the graph of the side is the right one, whatever this shell has.
[[nodiscard]] bool carries_data(const Json& status);

}  // namespace connect_bridge
