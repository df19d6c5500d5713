// `ctl check FILE`: what a side would do with a parameter file, without starting it.
#pragma once

#include <string>

namespace connect_bridge {

// Prints all problems, and what each rule allows to whom if that can be told. `role`: "server",
// "client", or empty: found from the file. Exit code: 0 in order, 2 not.
int check_file(const std::string& file, const std::string& role);

}  // namespace connect_bridge
