// `ctl status`: what a running side does, on one screen.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

struct StatusQuestion {
  std::string where;  // "127.0.0.1:9091", the file of a socket; empty: this user's programs
  bool json = false;
  bool watch = false;
};

// Adds the command to the program; the options go to `question`.
CLI::App* add_status_command(CLI::App& app, StatusQuestion& question);
// The program's exit code: 0 shown, 1 nobody answers, 2 the address is wrong.
int run_status(const StatusQuestion& question);
