#include "ros/parameters/parameter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace connect_bridge::ros {
namespace {

// The names of types in ROS's own messages.
const char* name_of(ParameterType type) {
  constexpr const char* kNames[] = {"not set",      "bool",        "integer",    "double",
                                    "string",       "byte_array",  "bool_array", "integer_array",
                                    "double_array", "string_array"};
  return kNames[static_cast<std::size_t>(type)];
}

// Matches "/*" with one segment of a name, and "/**" with any number of them.
bool matches(std::string_view pattern, std::string_view name) {
  if (pattern.empty()) return name.empty();
  const auto pattern_end = std::min(pattern.find('/', 1), pattern.size());
  const auto head = pattern.substr(0, pattern_end);
  const auto rest = pattern.substr(pattern_end);
  if (head == "/**" && matches(rest, name)) return true;
  if (name.empty()) return false;
  const auto name_end = std::min(name.find('/', 1), name.size());
  if (head == "/**") return matches(pattern, name.substr(name_end));
  if (head != "/*" && head != name.substr(0, name_end)) return false;
  return matches(rest, name.substr(name_end));
}

}  // namespace

SetResult check_value(const ParameterDescriptor& entry, ParameterValue& value) {
  switch (fit(entry.type, entry.range, value)) {
    case Fit::kYes: break;
    case Fit::kWrongType:
      return {false, "Wrong parameter type, parameter {" + entry.name + "} is of type {" +
                         name_of(entry.type) + "}, setting it to {" + name_of(type_of(value)) +
                         "} is not allowed."};
    case Fit::kOutOfRange:
      return {false, fmt::format("parameter '{}' must be in the range {:.15g} to {:.15g}",
                                 entry.name, entry.range->min, entry.range->max)};
  }
  return {};
}

bool is_listed(const std::string& name, const std::vector<std::string>& prefixes,
               std::uint64_t depth) {
  const auto shallow = [depth](std::string_view text) {
    return depth == 0 ||
           static_cast<std::uint64_t>(std::count(text.begin(), text.end(), '.')) < depth;
  };
  if (prefixes.empty()) return shallow(name);
  return std::any_of(prefixes.begin(), prefixes.end(), [&](const std::string& prefix) {
    if (name == prefix) return true;
    if (name.size() <= prefix.size() || name[prefix.size()] != '.') return false;
    return name.starts_with(prefix) && shallow(std::string_view{name}.substr(prefix.size() + 1));
  });
}

bool node_name_matches(const std::string& pattern, const std::string& full_name) {
  return matches(pattern.starts_with('/') ? pattern : "/" + pattern, full_name);
}

}  // namespace connect_bridge::ros
