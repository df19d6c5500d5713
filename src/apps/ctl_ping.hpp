// `ctl ping` and `ctl bench`: how good the link to a server is.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

struct PingOrder {
  std::string file;  // a client's parameter file; empty: what this user's client was paired with
  double seconds = 10;
  double interval = 0.2;
  bool json = false;
};

struct BenchOrder {
  std::string file;
  double seconds = 5;  // of each part
  std::uint64_t rate = 1'000'000;
  std::vector<std::string> topics;
  bool json = false;
  std::string svg;  // a file to write, too; empty: none
};

// These add the commands to the program; the options go to the order.
CLI::App* add_ping_command(CLI::App& app, PingOrder& order);
CLI::App* add_bench_command(CLI::App& app, BenchOrder& order);
// The program's exit code: 0 measured, 1 no link or it was lost, 2 the file is wrong.
int run_ping(const PingOrder& order);
int run_bench(const BenchOrder& order);
