#include "ctl/ctl_commands.hpp"

#include <cstdio>

#include "ctl/check.hpp"

int complain(const std::string& lines, int exit_code) {
  connect_bridge::say(stderr, lines);
  return exit_code;
}
