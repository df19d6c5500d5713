// The rules of ROS for parameters: types, ranges, lists, the node names of files.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/parameter.hpp"

namespace connect_bridge::ros {

struct SetResult {
  bool successful = true;
  std::string reason;
};

// Whether `value` may be set: fit() with ROS's words.
[[nodiscard]] SetResult check_value(const ParameterDescriptor& entry, ParameterValue& value);

// Whether a parameter named `name` is asked for by rcl_interfaces/srv/ListParameters.
[[nodiscard]] bool is_listed(const std::string& name, const std::vector<std::string>& prefixes,
                             std::uint64_t depth);

// Whether the node name of a parameter file ("/**", "/robot/*", "connect_server") means this node.
[[nodiscard]] bool node_name_matches(const std::string& pattern, const std::string& full_name);

}  // namespace connect_bridge::ros
