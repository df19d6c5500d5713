// Makes the parts of a bridge from a Config: reads files and the environment.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "run/parts.hpp"

namespace connect_bridge {

struct Assembly {
  std::optional<BridgeParts> parts;  // present exactly if there are no problems
  std::vector<Failure> problems;     // each names its key or file
  std::vector<std::string> warnings;
};

// `node`: the fully qualified name of our node. The pairing in `start` is part of the login.
Assembly assemble(const Config& config, const std::string& node, const Start& start = {});

// Takes the sockets that systemd passes to this process, if the server listens on these. Returns
// the problem; empty: none.
[[nodiscard]] std::string take_sockets(BridgeParts& parts);

// Overwrites the token in the environment, which core dumps and child processes would have.
void hide_environment();

}  // namespace connect_bridge
