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

// Whether `value` may be set: fit(), with the reason in ROS's words.
[[nodiscard]] SetResult check_value(const ParameterDescriptor& entry, ParameterValue& value);

// True if a request of rcl_interfaces/srv/ListParameters includes the parameter `name`.
[[nodiscard]] bool is_listed(const std::string& name, const std::vector<std::string>& prefixes,
                             std::uint64_t depth);

// True if the node name of a parameter file ("/**", "/robot/*", "connect_server") matches this
// node.
[[nodiscard]] bool node_name_matches(const std::string& pattern, const std::string& full_name);

}  // namespace connect_bridge::ros
