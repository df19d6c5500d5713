// `ctl check FILE`: what a side would do with a parameter file, without starting it.
#pragma once

#include <string>

#include "config/explain_right.hpp"

namespace connect_bridge {

// Prints as what it was checked, all problems, also those that only this machine shows, and, if
// possible, what each rule allows to whom. Executes no login plugin and sends nothing. `role`:
// "server", "client", or empty: found from the file. Exit code: 0 in order, 2 not. A certificate
// that has ended is not in order here, although a program starts with it.
int check_file(const std::string& file, const std::string& role);

// `ctl explain`: prints why the file's rules allow an interface or not. An identity without groups
// gets those that the file's auth.token_file gives it. Exit code: 0 if it is allowed, of two
// directions in one at least; 1 if not; 2 if the question or the file is wrong, which is printed to
// standard error.
int explain_file(const std::string& file, const std::string& asked_role,
                 const RightQuestion& question);

}  // namespace connect_bridge
