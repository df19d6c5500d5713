// The operator's tool beside the two programs.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "config/config.hpp"
#include "run/check.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Tools for ROS2 Connect"};
  app.require_subcommand(1);

  std::string file;
  std::string role;
  auto* check = app.add_subcommand("check", "What would a side do with this parameter file?");
  check->add_option("file", file, "A ROS 2 parameter file")->required();
  check->add_option("--role", role, "Of a node with a name of its own")
      ->check(CLI::IsMember({"server", "client"}));

  auto* document = app.add_subcommand("config-doc", "Print docs/config.md");

  CLI11_PARSE(app, argc, argv);
  if (*check) return connect_bridge::check_file(file, role);
  if (*document) std::fputs(connect_bridge::config_document().c_str(), stdout);
  return 0;
}
