// Parameter files as rcl reads them: the same reader for a node that starts and for `ctl check`.
#pragma once

#include <string>
#include <vector>

#include "ros/parameters/parameter.hpp"

struct rcl_params_s;

namespace connect_bridge::ros {

// The part of a file for the nodes of one name.
struct ParameterSection {
  std::string node;  // "connect_server", "/**", ...; see node_name_matches()
  ParameterMap parameters;
};

struct ParameterFile {
  std::vector<ParameterSection> sections;
  std::string problem;  // empty: the file was read
};

[[nodiscard]] ParameterFile read_parameter_file(const std::string& file);

// For src/ros only: the sections of parameters that rcl has parsed; frees these. None for null.
[[nodiscard]] std::vector<ParameterSection> take_sections(rcl_params_s* params);

}  // namespace connect_bridge::ros
