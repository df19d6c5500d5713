// Parameters between our values and the C messages of rcl_interfaces. All return false if memory
// runs out.
#pragma once

#include <rcl_interfaces/msg/parameter.h>
#include <rcl_interfaces/msg/parameter_descriptor.h>
#include <rcl_interfaces/msg/parameter_value.h>
#include <rosidl_runtime_c/string.h>

#include <string>
#include <string_view>
#include <vector>

#include "ros/parameters/parameter.hpp"

namespace connect_bridge::ros {

bool assign(rosidl_runtime_c__String& to, std::string_view text);
bool assign(rosidl_runtime_c__String__Sequence& to, const std::vector<std::string>& texts);
std::string text_of(const rosidl_runtime_c__String& text);
std::vector<std::string> texts_of(const rosidl_runtime_c__String__Sequence& texts);

// Without a value: PARAMETER_NOT_SET.
bool fill(rcl_interfaces__msg__ParameterValue& to, const std::optional<ParameterValue>& value);
bool fill(rcl_interfaces__msg__ParameterDescriptor& to, const ParameterDescriptor& entry);
bool fill(rcl_interfaces__msg__Parameter__Sequence& to, const std::vector<Parameter>& parameters);
Parameter parameter_of(const rcl_interfaces__msg__Parameter& message);

}  // namespace connect_bridge::ros
