// Arguments of main() that are for ROS.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace connect_bridge::ros {

// An option with a value between --ros-args and --, as rcl reads it: "-p", "x:=1".
struct RosOption {
  std::string word;
  std::string value;
};

struct SplitArguments {
  std::vector<RosOption> options;  // the wanted ones, in the order in which they are given
  std::vector<std::string> rest;   // all other arguments, the program's name first
};

// Takes the options with these words out of the arguments of main(). A word without a value stays
// among the rest: rcl refuses it.
[[nodiscard]] SplitArguments split_arguments(std::initializer_list<std::string_view> words,
                                             int argc, const char* const* argv);

// The values of the options with these words.
[[nodiscard]] std::vector<std::string> values_behind(std::initializer_list<std::string_view> words,
                                                     int argc, const char* const* argv);

// Options between --ros-args and -- that rcl does not know.
[[nodiscard]] std::vector<std::string> unknown_options(int argc, const char* const* argv);
// Options with a long name that rcl knows.
[[nodiscard]] std::vector<std::string> long_options();

// An argument without its value, which may be a secret: "KEY" in KEY:=VALUE, and in the typing
// errors KEY=VALUE, KEY:VALUE, "KEY VALUE".
[[nodiscard]] std::string_view without_value(std::string_view argument);

// The problems of remaps (-r, --remap) among these arguments of main(): all remaps except those of
// the node's own name and namespace. rcl applies remaps to topics and services of the bridge's own
// node, but not to names of others in the graph: only half of it would be renamed.
[[nodiscard]] std::vector<std::string> problems_of_remaps(int argc, const char* const* argv);

}  // namespace connect_bridge::ros
