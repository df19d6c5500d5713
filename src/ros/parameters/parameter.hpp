// Parameters as ROS knows them: values, descriptions, changes.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/bytes.hpp"

namespace connect_bridge::ros {

using ParameterValue =
    std::variant<bool, std::int64_t, double, std::string, std::vector<bool>,
                 std::vector<std::int64_t>, std::vector<double>, std::vector<std::string>, Bytes>;
using ParameterMap = std::map<std::string, ParameterValue, std::less<>>;

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

[[nodiscard]] ParameterType type_of(const ParameterValue& value);
[[nodiscard]] const char* name_of(ParameterType type);

// One parameter to set; without a value it is to be removed.
struct Parameter {
  std::string name;
  std::optional<ParameterValue> value;
};

// Both ends belong to the range; step 0: any value between them.
template <class Number>
struct Range {
  Number from{};
  Number to{};
  Number step{};
};

// One parameter as the services show it. A secret never is one.
struct ParameterEntry {
  std::string name;
  ParameterType type = ParameterType::kString;  // fixed, also while there is no value
  std::optional<ParameterValue> value;          // nullopt: not set
  std::string description;
  std::string constraints;  // in words: "one of urgent, high, normal, bulk"
  bool read_only = false;
  std::optional<Range<std::int64_t>> integer_range;
  std::optional<Range<double>> double_range;
};

struct SetResult {
  bool successful = true;
  std::string reason;
};

// Whether `value` may be set: type and range. An integer is taken for a double, an empty list for a
// list of any type, because a command line cannot tell them apart; `value` is changed accordingly.
[[nodiscard]] SetResult check_value(const ParameterEntry& entry, ParameterValue& value);

// Whether a parameter named `name` is asked for by rcl_interfaces/srv/ListParameters.
[[nodiscard]] bool is_listed(const std::string& name, const std::vector<std::string>& prefixes,
                             std::uint64_t depth);

// Whether the node name of a parameter file ("/**", "/robot/*", "connect_server") means this node.
[[nodiscard]] bool node_name_matches(const std::string& pattern, const std::string& full_name);

}  // namespace connect_bridge::ros
