// `ctl doctor`: why it does not work, with cause and cure.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

struct DoctorOrder {
  // A file, a URL, an address of a status or a socket; empty: what runs here.
  std::string what;
  std::string role;
  std::string token_file, ca, pin;  // for a URL
  bool offline = false;
  bool json = false;
  bool list = false;
};

// Adds the command to the program; the options go to `order`.
CLI::App* add_doctor_command(CLI::App& app, DoctorOrder& order);
// The program's exit code: 0 nothing is wrong, 1 something is, 2 the question is wrong.
int run_doctor(const DoctorOrder& order);
