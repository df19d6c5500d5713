// Parameter files, and single parameters of the command line, as rcl reads them: the same reader
// for a node that starts and for `ctl check`.
#pragma once

#include <string>
#include <vector>

#include "ros/parameters/parameter.hpp"

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

// Reads the file, and looks for keys that stand there twice. A pipe is read to its end.
[[nodiscard]] ParameterFile read_parameter_file(const std::string& file);

// Reads what stands behind -p: "KEY:=VALUE", or "NODE:KEY:=VALUE". Its problems begin with the key,
// and never show the value, which may be a secret.
[[nodiscard]] ParameterFile read_parameter_rule(const std::string& rule);

// Not a pipe. A file that is missing is one whose problem can be told.
[[nodiscard]] bool can_be_read_twice(const std::string& file);

}  // namespace connect_bridge::ros
