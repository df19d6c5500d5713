#include "ros/parameters/parameter_arguments.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "ros/parameters/ros_arguments.hpp"

namespace connect_bridge::ros {
namespace {

constexpr std::string_view kOfFile = "--params-file";

SplitArguments split(int argc, const char* const* argv) {
  return split_arguments({kOfFile, "-p", "--param"}, argc, argv);
}

}  // namespace

ParameterArguments::ParameterArguments(int argc, const char* const* argv) {
  for (RosOption& option : split(argc, argv).options)
    sources_.push_back({option.word == kOfFile, std::move(option.value), std::nullopt});
}

ParameterFile ParameterArguments::read(Source& source) {
  if (source.kept) return *source.kept;
  if (!source.is_file) return read_parameter_rule(source.text);
  const bool is_pipe = !can_be_read_twice(source.text);
  ParameterFile file = read_parameter_file(source.text);
  if (is_pipe && file.problems.empty()) source.kept = file;
  return file;
}

ParameterArguments::Read ParameterArguments::read_for(const std::string& full_name) {
  Read result;
  for (Source& source : sources_) {
    ParameterFile file = read(source);
    for (auto& problem : file.problems) result.problems.push_back(std::move(problem));
    for (auto& section : file.sections) {
      if (node_name_matches(section.node, full_name)) {
        for (auto& [key, value] : section.parameters)
          result.parameters.insert_or_assign(key, std::move(value));
      } else if (std::find(result.others.begin(), result.others.end(), section.node) ==
                 result.others.end()) {
        result.others.push_back(std::move(section.node));
      }
    }
  }
  if (!result.problems.empty()) return {{}, {}, std::move(result.problems)};
  return result;
}

std::vector<std::string> ParameterArguments::without(int argc, const char* const* argv) {
  return split(argc, argv).rest;
}

std::vector<std::string> ParameterArguments::files() const {
  std::vector<std::string> files;
  for (const Source& source : sources_)
    if (source.is_file) files.push_back(source.text);
  return files;
}

std::vector<std::string> problems_of_parameters(int argc, const char* const* argv) {
  std::vector<std::string> problems;
  for (const RosOption& option : split(argc, argv).options) {
    const bool is_file = option.word == kOfFile;
    if (is_file && !can_be_read_twice(option.value)) continue;
    ParameterFile read =
        is_file ? read_parameter_file(option.value) : read_parameter_rule(option.value);
    for (auto& problem : read.problems) problems.push_back(std::move(problem));
  }
  return problems;
}

}  // namespace connect_bridge::ros
