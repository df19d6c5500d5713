// The parameters among the arguments of main(): --params-file, -p and --param.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ros/parameters/parameter_file.hpp"

namespace connect_bridge::ros {

// The last one given wins, whatever kind of value, and whatever name of the node, it is given with.
// rcl merges all of them into one variant, which keeps one value of each kind and no order: an
// integer of a file would hide a later double of -p. So each is parsed by rcl alone, in its turn.
class ParameterArguments {
 public:
  ParameterArguments() = default;
  ParameterArguments(int argc, const char* const* argv);

  // What they mean for one node.
  struct Read {
    ParameterMap parameters;
    std::vector<std::string> others;    // other nodes that have parameters: "/camera"
    std::vector<std::string> problems;  // each with its file or its key; then nothing else is told
  };
  // Reads the files again each time. A pipe can be read once: it keeps what it had.
  [[nodiscard]] Read read_for(const std::string& full_name);

  // The other arguments: without them rcl reads no parameters.
  [[nodiscard]] static std::vector<std::string> without(int argc, const char* const* argv);

  // The files of --params-file, in their order.
  [[nodiscard]] std::vector<std::string> files() const;

 private:
  struct Source {
    bool is_file = false;
    std::string text;  // the file's path, or "KEY:=VALUE"
    std::optional<ParameterFile> kept;
  };

  static ParameterFile read(Source& source);

  std::vector<Source> sources_;
};

// All that is wrong with the parameters among the arguments of main(), before rcl reads them: rcl's
// own message names neither the file nor the reason. Pipes are left for the one that uses them.
[[nodiscard]] std::vector<std::string> problems_of_parameters(int argc, const char* const* argv);

}  // namespace connect_bridge::ros
