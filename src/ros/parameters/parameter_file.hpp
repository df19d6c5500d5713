// Parameter files, read as rcl reads them: by the same reader for a node's start and `ctl check`.
#pragma once

#include <string>
#include <vector>

#include "core/ports/failure.hpp"
#include "ros/parameters/parameter.hpp"

namespace connect_bridge::ros {

// The part of a file for nodes of one name.
struct ParameterSection {
  std::string node;  // "connect_server", "/**", ...; see node_name_matches()
  ParameterMap parameters;
};

struct ParameterFile {
  std::vector<ParameterSection> sections;
  // All problems of the file, each with the file's name and, if known, the line: the file cannot be
  // opened, is not YAML, gives a key twice, or has content that rcl refuses. rcl itself silently
  // uses the last of two equal keys, so a rule could lose its `groups` unseen.
  std::vector<std::string> problems;
  Cause cause = Cause::kNone;  // of the problems

  // All problems in one line; empty: the file was read.
  [[nodiscard]] std::string problem() const;
};

// Reads the file, and finds keys that are given twice (not in a pipe, which can be read only once).
[[nodiscard]] ParameterFile read_parameter_file(const std::string& file);

// Reads what stands behind -p: "KEY:=VALUE", or "NODE:KEY:=VALUE". Its problems begin with the key,
// and never show the value, which may be a secret.
[[nodiscard]] ParameterFile read_parameter_rule(const std::string& rule);

// Not a pipe. A file that is missing is one whose problem can be told.
[[nodiscard]] bool can_be_read_twice(const std::string& file);

}  // namespace connect_bridge::ros
