// The words of the programs' own that stand before or behind those for ROS.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/side/side.hpp"

namespace connect_bridge {

struct Arguments {
  bool pairs = false;      // server: --pair
  std::string host;        // server: what clients shall dial, "robot.example:443"; or empty
  std::string invitation;  // client: wss+pair://...; empty: none
  std::vector<std::string> problems;
};

// Of what is left when ROS has taken its arguments.
[[nodiscard]] Arguments read_arguments(const std::vector<std::string>& words, Role role);

}  // namespace connect_bridge
