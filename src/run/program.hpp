// The programs `server` and `client`: they differ in the role alone.
#pragma once

#include "core/ports/net_options.hpp"

namespace connect_bridge {

// Exit codes: 0 orderly end, --help or --version, 1 ROS does not start, 2 wrong configuration (also
// a parameter file that cannot be read) or the port cannot be opened, 3 an error while running, or
// the loop stood still (run/loop_guard.hpp).
int run_program(Role role, int argc, char** argv);

}  // namespace connect_bridge
