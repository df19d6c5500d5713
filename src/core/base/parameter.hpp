// Parameters of a node as values: the configuration reads them, the parameter services show them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
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

// One parameter to set; without a value it is to be removed.
struct Parameter {
  std::string name;
  std::optional<ParameterValue> value;
};

// What the parameter services say about one parameter.
struct ParameterDescriptor {
  std::string name;
  ParameterType type = ParameterType::kString;  // fixed, also while there is no value
  std::optional<ParameterValue> value;          // nullopt: not set
  std::string description;
  std::string constraints;         // in words: "one of urgent, high, normal, bulk"
  std::optional<double> min, max;  // of a number, none or both; they belong to the range
  bool read_only = false;
};

}  // namespace connect_bridge
