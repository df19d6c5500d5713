// Remaps on the command line.
#pragma once

#include <string>
#include <vector>

namespace connect_bridge::ros {

// What is wrong with the remaps (-r, --remap) among these arguments of main(): all but those of the
// node's own name and namespace. rcl applies them to the topics and services of the bridge's own
// node, but not to what the graph shows of others: only half of it would be renamed.
[[nodiscard]] std::vector<std::string> problems_of_remaps(int argc, const char* const* argv);

}  // namespace connect_bridge::ros
