#include "ros/node/remaps.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "ros/node/ros_arguments.hpp"

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

std::vector<std::string> problems_of_remaps(int argc, const char* const* argv) {
  std::vector<std::string> problems;
  for (const auto& remap : values_behind({"-r", "--remap"}, argc, argv))
    if (!names_the_node(remap))
      problems.push_back("the remap " + remap +
                         ": what crosses is renamed by the parameters remap and prefix, not by -r");
  return problems;
}

}  // namespace connect_bridge::ros
