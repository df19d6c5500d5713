// The arguments of main() that are for ROS.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace connect_bridge::ros {

// What stands behind each of these words between --ros-args and --.
[[nodiscard]] inline std::vector<std::string> values_behind(
    std::initializer_list<std::string_view> words, int argc, const char* const* argv) {
  std::vector<std::string> values;
  bool for_ros = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument(argv[i]);
    if (argument == "--ros-args" || argument == "--") {
      for_ros = argument == "--ros-args";
    } else if (for_ros && i + 1 < argc &&
               std::find(words.begin(), words.end(), argument) != words.end()) {
      values.emplace_back(argv[++i]);
    }
  }
  return values;
}

}  // namespace connect_bridge::ros
