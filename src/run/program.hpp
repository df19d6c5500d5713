// The programs `server` and `client`: they differ in the role alone.
#pragma once

#include "core/ports/net_options.hpp"

namespace connect_bridge {

// Runs until a signal or an error; returns the exit code (run/exit_codes.hpp).
int run_program(Role role, int argc, char** argv);

}  // namespace connect_bridge
