// The operator's tool beside the two programs.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "config/document.hpp"
#include "config/key_search.hpp"
#include "ctl/check.hpp"
#include "ctl/ctl_commands.hpp"
#include "ros/rcl/missing_middleware.hpp"
#include "run/exit_codes.hpp"

namespace {

using connect_bridge::kExitConfiguration;
using connect_bridge::ros::kRmwVariables;

// rcl ends a process as it is loaded, before main(), when the RMW is missing that the environment
// names: the very fault that `ctl` is asked about. So `ctl` hides these variables until then.
// In a library this would happen to each program that links it.
constexpr int kHiddenMax = sizeof(kRmwVariables) / sizeof(kRmwVariables[0]);
const char* hidden_values[kHiddenMax];  // their values, where they stood

// The value in "NAME=value"; null: it is another variable.
__attribute__((no_sanitize("address", "undefined", "thread"))) const char* value_behind(
    const char* entry, const char* name) {
  while (*name != '\0' && *entry == *name) ++entry, ++name;
  return *name == '\0' && *entry == '=' ? entry + 1 : nullptr;
}

// Runs before the libraries are initialized: it calls none of them.
__attribute__((no_sanitize("address", "undefined", "thread"))) void hide_variables(
    int, char**, char** environment) {
  char** kept = environment;
  for (char** entry = environment; *entry != nullptr; ++entry) {
    bool is_kept = true;
    for (int i = 0; i < kHiddenMax; ++i) {
      const char* const value = value_behind(*entry, kRmwVariables[i]);
      if (value == nullptr) continue;
      hidden_values[i] = value;
      is_kept = false;
    }
    if (is_kept) *kept++ = *entry;
  }
  *kept = nullptr;
}

__attribute__((section(".preinit_array"),
               used)) void (*const kHideVariables)(int, char**, char**) = hide_variables;

// From now on these variables are in the environment, as the user has set them.
void show_rmw_variables() {
  for (int i = 0; i < kHiddenMax; ++i)
    if (hidden_values[i] != nullptr) ::setenv(kRmwVariables[i], hidden_values[i], 0);
}

int write_tables(const std::string& manual) {
  if (manual.empty()) {
    std::fputs(connect_bridge::config_tables().c_str(), stdout);
    return 0;
  }
  std::ifstream file(manual);
  std::ostringstream content;
  if (!file || !(content << file.rdbuf()))
    return complain(manual + ": cannot be read", kExitConfiguration);
  const auto document = connect_bridge::config_document(content.str());
  if (!document)
    return complain(manual + ": has no marks between which the table stands", kExitConfiguration);
  std::ofstream out(manual);
  if (!(out << *document << std::flush))
    return complain(manual + ": cannot be written", kExitConfiguration);
  return 0;
}

// CLI11 only reports that a subcommand is required, whatever word is in its place. The help would
// hide the name that was meant.
std::string complaint_of(const CLI::App& app, const CLI::Error& wrong) {
  const std::string help = "\n\n" + app.help();
  const auto unknown = app.remaining();
  if (unknown.empty() || !app.get_subcommands().empty()) return wrong.what() + help;
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  const std::string best = connect_bridge::nearest_of(names, unknown.front());
  return "\"" + unknown.front() + "\" is unknown: " +
         (best.empty() ? "a subcommand is required" + help : "did you mean " + best + "?\n");
}

}  // namespace

int main(int argc, char** argv) {
  show_rmw_variables();
  CLI::App app{"ctl: tools for ROS2 Connect, the bridge that joins two ROS 2 graphs"};
  app.require_subcommand(1);
  app.set_version_flag("--version", connect_bridge::version_text(), "Print the version");
  app.failure_message(
      [](const CLI::App* failed, const CLI::Error& wrong) { return complaint_of(*failed, wrong); });

  int exit_code = 0;
  std::string file, role;
  auto* check =
      app.add_subcommand("check", "Say what a server or client would do with a parameter file");
  check->add_option("file", file, "A ROS 2 parameter file")->required();
  check->add_option("--role", role, "For a node with a name of its own: server or client")
      ->check(CLI::IsMember({"server", "client"}));
  check->callback([&] { exit_code = connect_bridge::check_file(file, role); });

  std::string manual;
  auto* document = app.add_subcommand("config-doc", "Print the table of all parameters");
  document->add_option("manual", manual,
                       "Instead, write the table into this file, between its marks");
  document->callback([&] { exit_code = write_tables(manual); });

  for (const auto add :
       {add_certs_command, add_token_command, add_explain_command, add_status_command,
        add_doctor_command, add_bugreport_command, add_ping_command, add_bench_command})
    add(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& wrong) {
    return app.exit(wrong) == 0 ? 0 : kExitConfiguration;
  }
  return exit_code;
}
