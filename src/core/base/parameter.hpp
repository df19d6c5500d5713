// Parameters of a node as values: the configuration reads them, the parameter services show them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/bytes.hpp"

namespace connect_bridge {

// The numbers of rcl_interfaces/msg/ParameterType.
enum class ParameterType : std::uint8_t {
  kNotSet,
  kBool,
  kInteger,
  kDouble,
  kString,
  kBytes,
  kBools,
  kIntegers,
  kDoubles,
  kStrings
};

// In the order of ParameterType.
using ParameterValue =
    std::variant<bool, std::int64_t, double, std::string, Bytes, std::vector<bool>,
                 std::vector<std::int64_t>, std::vector<double>, std::vector<std::string>>;

[[nodiscard]] inline ParameterType type_of(const ParameterValue& value) {
  return static_cast<ParameterType>(value.index() + 1);
}

// Dotted names ("rule.drive.import_topics") with their values.
using ParameterMap = std::map<std::string, ParameterValue, std::less<>>;

// The text of one; empty: it is not given, or is no text.
[[nodiscard]] inline std::string string_at(const ParameterMap& parameters, std::string_view name) {
  const auto found = parameters.find(name);
  const auto* text = found == parameters.end() ? nullptr : std::get_if<std::string>(&found->second);
  return text != nullptr ? *text : std::string{};
}

// One parameter to set; without a value it is to be removed.
struct Parameter {
  std::string name;
  std::optional<ParameterValue> value;
};

// Both ends belong to it; NaN is outside of every one.
struct NumberRange {
  double min = 0;
  double max = 0;
};

enum class Fit : std::uint8_t { kYes, kWrongType, kOutOfRange };

// Whether a parameter of this type and range (of a number; none: any) may have the value. An
// integer is accepted for a double, and an empty list of any type for one of strings, because they
// look the same on a command line; `value` is converted accordingly.
[[nodiscard]] inline Fit fit(ParameterType type, const std::optional<NumberRange>& range,
                             ParameterValue& value) {
  const auto is_empty = [](const auto& held) {
    if constexpr (requires { held.empty(); }) return held.empty();
    return false;
  };
  if (type == ParameterType::kDouble && type_of(value) == ParameterType::kInteger) {
    value = static_cast<double>(std::get<std::int64_t>(value));
  } else if (type == ParameterType::kStrings && type_of(value) != ParameterType::kString &&
             std::visit(is_empty, value)) {
    value = std::vector<std::string>{};
  }
  if (type_of(value) != type) return Fit::kWrongType;
  if (!range) return Fit::kYes;
  const auto* whole = std::get_if<std::int64_t>(&value);
  const double number = whole != nullptr ? static_cast<double>(*whole) : std::get<double>(value);
  return number >= range->min && number <= range->max ? Fit::kYes : Fit::kOutOfRange;
}

// The description of one parameter for the parameter services.
struct ParameterDescriptor {
  std::string name;
  ParameterType type = ParameterType::kString;  // fixed, also while there is no value
  std::optional<ParameterValue> value;          // nullopt: not set
  std::string description;
  std::string constraints;  // in words: "one of urgent, high, normal, bulk"
  std::optional<NumberRange> range;
  bool read_only = false;
};

}  // namespace connect_bridge
