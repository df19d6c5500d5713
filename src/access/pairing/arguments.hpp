// The programs' own arguments, before or after those for ROS.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/ports/net_options.hpp"

namespace connect_bridge {

struct Arguments {
  bool pairs = false;          // server: --pair
  Role robot = Role::kServer;  // the client, with --drive at the server or --robot at the client
  bool operates = false;       // --operate: the peer of the robot may do more than look
  std::string host;            // server: address for clients, "robot.example:443"; or empty
  std::string via;             // server: wss+relay://..., by registration command; empty: no relay
  std::string invitation;      // client: wss+pair://...; empty: none
  std::vector<std::string> problems;
};

// Reads the arguments that are left when ROS has taken its own.
[[nodiscard]] Arguments read_arguments(const std::vector<std::string>& words, Role role);

}  // namespace connect_bridge
