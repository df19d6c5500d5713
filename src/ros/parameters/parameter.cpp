#include "ros/parameters/parameter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

namespace connect_bridge::ros {
namespace {

bool is_empty_list(const ParameterValue& value) {
  return std::visit(
      [](const auto& held) {
        if constexpr (requires { held.empty(); }) {
          return held.empty();
        } else {
          return false;
        }
      },
      value);
}

std::optional<ParameterValue> empty_list(ParameterType type) {
  switch (type) {
    case ParameterType::kBytes: return Bytes{};
    case ParameterType::kBools: return std::vector<bool>{};
    case ParameterType::kIntegers: return std::vector<std::int64_t>{};
    case ParameterType::kDoubles: return std::vector<double>{};
    case ParameterType::kStrings: return std::vector<std::string>{};
    default: return std::nullopt;
  }
}

void adapt(ParameterType type, ParameterValue& value) {
  if (type_of(value) == type) return;
  if (type == ParameterType::kDouble && std::holds_alternative<std::int64_t>(value)) {
    value = static_cast<double>(std::get<std::int64_t>(value));
  } else if (type == ParameterType::kDoubles &&
             std::holds_alternative<std::vector<std::int64_t>>(value)) {
    const auto numbers = std::get<std::vector<std::int64_t>>(value);
    value = std::vector<double>(numbers.begin(), numbers.end());
  } else if (type_of(value) != ParameterType::kString && is_empty_list(value)) {
    if (auto list = empty_list(type)) value = std::move(*list);
  }
}

// Written so that NaN is outside of every range.
bool in_range(const ParameterDescriptor& entry, double value) {
  return (!entry.min || value >= *entry.min) && (!entry.max || value <= *entry.max);
}

}  // namespace

const char* name_of(ParameterType type) {
  constexpr const char* kNames[] = {"not set",      "bool",        "integer",    "double",
                                    "string",       "byte_array",  "bool_array", "integer_array",
                                    "double_array", "string_array"};
  return kNames[static_cast<std::size_t>(type)];
}

SetResult check_value(const ParameterDescriptor& entry, ParameterValue& value) {
  adapt(entry.type, value);
  if (type_of(value) != entry.type) {
    return {false, "Wrong parameter type, parameter {" + entry.name + "} is of type {" +
                       name_of(entry.type) + "}, setting it to {" + name_of(type_of(value)) +
                       "} is not allowed."};
  }
  const auto* integer = std::get_if<std::int64_t>(&value);
  const auto* number = std::get_if<double>(&value);
  if ((integer && !in_range(entry, static_cast<double>(*integer))) ||
      (number && !in_range(entry, *number))) {
    return {false, fmt::format("parameter '{}' must be in the range {:.15g} to {:.15g}", entry.name,
                               entry.min.value_or(-HUGE_VAL), entry.max.value_or(HUGE_VAL))};
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

namespace {

// "/*" stands for one segment of a name, "/**" for any number of them.
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

bool node_name_matches(const std::string& pattern, const std::string& full_name) {
  return matches(pattern.starts_with('/') ? pattern : "/" + pattern, full_name);
}

}  // namespace connect_bridge::ros
