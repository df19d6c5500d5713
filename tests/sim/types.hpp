// The hashes of the simulator's types.
#pragma once

#include <string>

namespace connect_bridge::sim {

// The same in all graphs.
[[nodiscard]] inline std::string hash_of_type(const std::string& type) {
  return "RIHS01_" + type;
}

}  // namespace connect_bridge::sim
