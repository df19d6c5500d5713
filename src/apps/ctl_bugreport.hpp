// `ctl bugreport`: one file for whoever is asked for help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

struct BugreportOrder {
  std::vector<std::string> files;  // parameter files beside those that running programs have
  std::string output;              // empty: a name with the time, in the present folder
};

// Adds the command to the program; the options go to `order`.
CLI::App* add_bugreport_command(CLI::App& app, BugreportOrder& order);
// The program's exit code: 0 written, 2 it cannot be.
int run_bugreport(const BugreportOrder& order);
