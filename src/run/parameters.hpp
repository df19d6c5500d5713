// Between the parameters of ROS and those of the configuration, which do not know each other.
#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"
#include "ros/parameters/parameter.hpp"

namespace connect_bridge {

// Byte arrays have no counterpart: they come as a problem.
ParameterMap to_config(const ros::ParameterMap& parameters, std::vector<Problem>& problems);

// The change as the configuration understands it; problems as above.
ParameterChanges to_config(const std::vector<ros::Parameter>& parameters,
                           std::vector<Problem>& problems);

ros::ParameterEntry to_entry(const KeyDescriptor& descriptor);
std::vector<ros::ParameterEntry> to_entries(const std::vector<KeyDescriptor>& descriptors);

}  // namespace connect_bridge
