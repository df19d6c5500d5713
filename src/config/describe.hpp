// The table of keys as descriptors of ROS parameters.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "config/config.hpp"

namespace connect_bridge {

// One per parameter of this role, the given keys of rules included; secrets are left out. The value
// is the given one or the default.
[[nodiscard]] std::vector<ParameterDescriptor> describe_parameters(const Config& config);
// For a key that may be set later ("rule.new.priority"); nullopt: unknown, secret or of the other
// role.
[[nodiscard]] std::optional<ParameterDescriptor> describe_parameter(std::string_view key,
                                                                    Role role);

}  // namespace connect_bridge
