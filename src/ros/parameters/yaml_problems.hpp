// Mistakes in the YAML of a parameter file, with the line and the cure, for people.
#pragma once

#include <istream>
#include <string>
#include <vector>

namespace connect_bridge::ros {

struct YamlProblems {
  std::vector<std::string> certain;
  std::vector<std::string> if_refused;  // what is wrong if rcl refuses the file
};

// rcl names neither a key nor a cure, and takes the last of two equal keys without a word. `file`:
// its name, with which each problem begins.
[[nodiscard]] YamlProblems yaml_problems(const std::string& file, std::istream& text);

}  // namespace connect_bridge::ros
