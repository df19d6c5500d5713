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
  // All that is wrong with the file, each with its name and, where known, the line: it cannot be
  // opened, is not YAML, gives a key twice, or holds what rcl does not take. rcl itself uses the
  // last of two equal keys and says nothing, so that a rule could lose its `groups` unseen.
  std::vector<std::string> problems;

  // All of them in one line; empty: the file was read.
  [[nodiscard]] std::string problem() const;
};

// Reads the file, and looks for keys that stand there twice (not in a pipe, which can be read only
// once).
[[nodiscard]] ParameterFile read_parameter_file(const std::string& file);

// The problems of all files of --params-file among the arguments of main(), before rcl reads them:
// rcl's own message names neither the file nor the reason.
[[nodiscard]] std::vector<std::string> problems_of_parameter_files(int argc,
                                                                   const char* const* argv);

// For src/ros only: the sections of parameters that rcl has parsed; frees these. None for null.
[[nodiscard]] std::vector<ParameterSection> take_sections(rcl_params_s* params);

}  // namespace connect_bridge::ros
