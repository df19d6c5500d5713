// The programs `server` and `client`, which differ only in their role.
#pragma once

#include "core/ports/net_options.hpp"

namespace connect_bridge {

// Runs until a signal or an error; returns the exit code (run/exit_codes.hpp).
int run_program(Role role, int argc, char** argv);

}  // namespace connect_bridge
