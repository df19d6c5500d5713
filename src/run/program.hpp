// The programs `server` and `client`: they differ in the role alone. How they and `ctl` end.
#pragma once

#include "core/ports/net_options.hpp"

namespace connect_bridge {

// Exit codes; 0 is an orderly end, --help or --version.
inline constexpr int kExitRos = 1;         // ROS does not start
inline constexpr int kExitNotAllowed = 1;  // `ctl explain`: nothing that was asked is allowed
// The configuration, or the invitation, is wrong, or the port cannot be opened.
inline constexpr int kExitConfiguration = 2;
inline constexpr int kExitFailed = 3;  // an error, or a loop that stood still, ended it

int run_program(Role role, int argc, char** argv);

}  // namespace connect_bridge
