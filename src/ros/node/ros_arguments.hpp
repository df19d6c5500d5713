// The arguments of main() that are for ROS.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace connect_bridge::ros {

// What stands behind each of these words between --ros-args and --.
[[nodiscard]] std::vector<std::string> values_behind(std::initializer_list<std::string_view> words,
                                                     int argc, const char* const* argv);

// What is wrong with the remaps (-r, --remap) among these arguments of main(): all but those of the
// node's own name and namespace. rcl applies them to the topics and services of the bridge's own
// node, but not to what the graph shows of others: only half of it would be renamed.
[[nodiscard]] std::vector<std::string> problems_of_remaps(int argc, const char* const* argv);

}  // namespace connect_bridge::ros
