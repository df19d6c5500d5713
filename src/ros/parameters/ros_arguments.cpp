#include "ros/parameters/ros_arguments.hpp"

#include <algorithm>
#include <array>

namespace connect_bridge::ros {
namespace {

// True for "__node:=x", also for one node alone: "connect_client:__node:=x".
bool names_the_node(std::string_view remap) {
  constexpr std::array<std::string_view, 3> kOfNode = {"__node", "__name", "__ns"};
  const std::string_view from = remap.substr(0, remap.find(":="));
  const std::string_view last = from.substr(from.rfind(':') + 1);
  return std::find(kOfNode.begin(), kOfNode.end(), last) != kOfNode.end();
}

// The options of rcl that take the next argument.
constexpr auto kWithValue = std::to_array<std::string_view>(
    {"-p", "--param", "-r", "--remap", "--params-file", "-e", "--enclave", "--log-level",
     "--log-config-file", "--log-file-name"});

// Those that take none.
constexpr auto kSwitches = std::to_array<std::string_view>(
    {"--enable-rosout-logs", "--disable-rosout-logs", "--enable-stdout-logs",
     "--disable-stdout-logs", "--enable-external-lib-logs", "--disable-external-lib-logs"});

template <class Words>
bool is_one_of(const Words& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace

SplitArguments split_arguments(std::initializer_list<std::string_view> words, int argc,
                               const char* const* argv) {
  SplitArguments split;
  bool for_ros = false;
  for (int i = 0; i < argc; ++i) {
    const std::string_view argument(argv[i]);
    if (argument == "--ros-args" || argument == "--") for_ros = argument == "--ros-args";
    const bool has_value = for_ros && i + 1 < argc && is_one_of(kWithValue, argument);
    if (has_value && is_one_of(words, argument)) {
      split.options.push_back({argv[i], argv[i + 1]});
      ++i;
      continue;
    }
    split.rest.emplace_back(argument);
    // The value is none of the words, whatever it looks like.
    if (has_value) split.rest.emplace_back(argv[++i]);
  }
  return split;
}

std::vector<std::string> values_behind(std::initializer_list<std::string_view> words, int argc,
                                       const char* const* argv) {
  std::vector<std::string> values;
  for (RosOption& option : split_arguments(words, argc, argv).options)
    values.push_back(std::move(option.value));
  return values;
}

std::vector<std::string> unknown_options(int argc, const char* const* argv) {
  std::vector<std::string> unknown;
  bool for_ros = false;
  for (int i = 0; i < argc; ++i) {
    const std::string_view word(argv[i]);
    if (word == "--ros-args" || word == "--") {
      for_ros = word == "--ros-args";
    } else if (for_ros && is_one_of(kWithValue, word)) {
      ++i;  // its value, whatever it looks like
    } else if (for_ros && word.starts_with("--") && !is_one_of(kSwitches, word)) {
      unknown.emplace_back(word);
    }
  }
  return unknown;
}

std::vector<std::string> long_options() {
  std::vector<std::string> all(kSwitches.begin(), kSwitches.end());
  for (const std::string_view word : kWithValue)
    if (word.starts_with("--")) all.emplace_back(word);
  return all;
}

std::string_view without_value(std::string_view argument) {
  return argument.substr(0, argument.find_first_of(":= \t\r\n"));
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
