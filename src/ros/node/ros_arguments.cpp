#include "ros/node/ros_arguments.hpp"

#include <algorithm>
#include <array>

namespace connect_bridge::ros {
namespace {

// "__node:=x", also for one node alone: "connect_client:__node:=x".
bool names_the_node(std::string_view remap) {
  constexpr std::array<std::string_view, 3> kOfNode = {"__node", "__name", "__ns"};
  const std::string_view from = remap.substr(0, remap.find(":="));
  const std::string_view last = from.substr(from.rfind(':') + 1);
  return std::find(kOfNode.begin(), kOfNode.end(), last) != kOfNode.end();
}

}  // namespace

std::vector<std::string> values_behind(std::initializer_list<std::string_view> words, int argc,
                                       const char* const* argv) {
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

std::vector<std::string> problems_of_remaps(int argc, const char* const* argv) {
  std::vector<std::string> problems;
  for (const auto& remap : values_behind({"-r", "--remap"}, argc, argv))
    if (!names_the_node(remap))
      problems.push_back("the remap " + remap +
                         ": what crosses is renamed by the parameters remap and prefix, not by -r");
  return problems;
}

}  // namespace connect_bridge::ros
