#include "run/check.hpp"

#include <cstdio>
#include <optional>
#include <vector>

#include "config/explain.hpp"
#include "ros/parameters/parameter_file.hpp"
#include "run/assembly.hpp"

namespace connect_bridge {
namespace {

constexpr int kExitConfiguration = 2;
constexpr char kServerNode[] = "/connect_server";
constexpr char kClientNode[] = "/connect_client";

struct Given {
  bool found = false;
  ParameterMap parameters;
};

Given parameters_for(const ros::ParameterFile& file, const std::string& node) {
  Given given;
  for (const auto& section : file.sections) {
    if (!ros::node_name_matches(section.node, node)) continue;
    given.found = true;
    for (const auto& [key, value] : section.parameters)
      given.parameters.insert_or_assign(key, value);
  }
  return given;
}

// A file for any node ("/**") is a client's if it says whom to dial.
std::optional<Role> role_of(const ros::ParameterFile& file, const std::string& asked) {
  if (asked == "server") return Role::kServer;
  if (asked == "client") return Role::kClient;
  const Given server = parameters_for(file, kServerNode);
  const Given client = parameters_for(file, kClientNode);
  if (client.found && (!server.found || client.parameters.contains("url"))) return Role::kClient;
  if (server.found) return Role::kServer;
  return std::nullopt;
}

int report(const std::string& file, const std::vector<std::string>& problems) {
  std::fprintf(stderr, "%s: %zu problem%s\n", file.c_str(), problems.size(),
               problems.size() == 1 ? "" : "s");
  for (const auto& problem : problems) std::fprintf(stderr, "  %s\n", problem.c_str());
  return kExitConfiguration;
}

}  // namespace

int check_file(const std::string& file, const std::string& asked_role) {
  const ros::ParameterFile read = ros::read_parameter_file(file);
  if (!read.problem.empty()) return report(file, {read.problem});
  const auto role = role_of(read, asked_role);
  if (!role)
    return report(file,
                  {"no parameters for connect_server or connect_client; with another node name say "
                   "--role server or --role client"});
  const std::string node = *role == Role::kServer ? kServerNode : kClientNode;
  Given given = parameters_for(read, node);
  if (!given.found && read.sections.size() == 1) given.parameters = read.sections[0].parameters;
  const Parsed parsed = parse_config(given.parameters, *role, surroundings());
  std::vector<std::string> problems;
  for (const auto& problem : parsed.problems) problems.push_back(to_text(problem));
  Assembly assembly;
  if (parsed.config) {
    assembly = assemble(*parsed.config, node);
    problems = assembly.problems;
  }
  const int code = problems.empty() ? 0 : report(file, problems);
  // The token and the files that are missing on this machine change nothing of what the rest means.
  Surroundings elsewhere;
  elsewhere.token_in_environment = true;
  const Parsed rest = parsed.config ? parsed : parse_config(given.parameters, *role, elsewhere);
  if (!rest.config) return code;
  if (code != 0) std::puts("The rest of the file means:");
  std::fputs(explain(*rest.config).c_str(), stdout);
  for (const auto& warning : assembly.warnings) std::printf("warning: %s\n", warning.c_str());
  return code;
}

}  // namespace connect_bridge
