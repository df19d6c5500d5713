// From a Config to the parts of a bridge: files and the environment are read here.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "run/parts.hpp"

namespace connect_bridge {

struct Assembly {
  std::optional<BridgeParts> parts;   // present exactly if there are no problems
  std::vector<std::string> problems;  // sentences, each naming key or file
  std::vector<std::string> warnings;
};

// `node`: the fully qualified name of ours.
// The pairing in `start` is part of the login.
Assembly assemble(const Config& config, const std::string& node, const Start& start = {});

// The sockets that systemd passes to this process, if the server listens on these. What is wrong,
// or nothing.
[[nodiscard]] std::string take_sockets(BridgeParts& parts);

// Overwrites the token in the environment, which core dumps and child processes would have.
void hide_environment();

}  // namespace connect_bridge
