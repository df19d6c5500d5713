#include "run/check.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <string_view>
#include <vector>

#include "config/explain.hpp"
#include "config/explain_right.hpp"
#include "core/wire/text.hpp"
#include "ros/parameters/parameter_file.hpp"
#include "run/assembly.hpp"
#include "run/exit_codes.hpp"

namespace connect_bridge {
namespace {

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

// A file for any node ("/**") is a client's if it has a url.
std::optional<Role> role_of(const ros::ParameterFile& file, const std::string& asked) {
  if (asked == "server") return Role::kServer;
  if (asked == "client") return Role::kClient;
  const Given server = parameters_for(file, kServerNode);
  const Given client = parameters_for(file, kClientNode);
  if (client.found && (!server.found || client.parameters.contains("url"))) return Role::kClient;
  if (server.found) return Role::kServer;
  return std::nullopt;
}

// Lines. What somebody else's file contains must be no command to the terminal.
void print(std::FILE* to, std::string_view lines) {
  while (!lines.empty()) {
    const std::string_view line = lines.substr(0, lines.find('\n'));
    std::fprintf(to, "%s\n", to_text(line, line.size()).c_str());
    lines.remove_prefix(std::min(line.size() + 1, lines.size()));
  }
}

int report(const std::string& file, const std::vector<std::string>& problems) {
  print(stderr, file + ": " + std::to_string(problems.size()) +
                    (problems.size() == 1 ? " problem" : " problems"));
  for (const auto& problem : problems) print(stderr, "  " + problem);
  return kExitConfiguration;
}

// The part of a file for one of our nodes.
struct OfNode {
  Role role = Role::kServer;
  std::string node;
  ParameterMap parameters;
  std::vector<std::string> problems;  // empty: the rest is valid
};

OfNode read_for_node(const std::string& file, const std::string& asked_role) {
  OfNode result;
  const ros::ParameterFile read = ros::read_parameter_file(file);
  if (!read.problem.empty()) {
    result.problems = {read.problem};
    return result;
  }
  const auto role = role_of(read, asked_role);
  if (!role) {
    result.problems = {
        "no parameters for connect_server or connect_client; for a node with another name give "
        "--role server or --role client"};
    return result;
  }
  result.role = *role;
  result.node = *role == Role::kServer ? kServerNode : kClientNode;
  Given given = parameters_for(read, result.node);
  if (!given.found && read.sections.size() == 1) given.parameters = read.sections[0].parameters;
  result.parameters = std::move(given.parameters);
  return result;
}

// A token or files that are missing on this machine do not change what the rest means.
Parsed parse_as_elsewhere(const OfNode& of_node) {
  Surroundings elsewhere;
  elsewhere.token_in_environment = true;
  return parse_config(of_node.parameters, of_node.role, elsewhere);
}

}  // namespace

int check_file(const std::string& file, const std::string& asked_role) {
  const OfNode of_node = read_for_node(file, asked_role);
  if (!of_node.problems.empty()) return report(file, of_node.problems);
  const Parsed parsed = parse_config(of_node.parameters, of_node.role, surroundings());
  std::vector<std::string> problems;
  for (const auto& problem : parsed.problems) problems.push_back(to_text(problem));
  Assembly assembly;
  if (parsed.config) {
    assembly = assemble(*parsed.config, of_node.node);
    problems = assembly.problems;
  }
  const int code = problems.empty() ? 0 : report(file, problems);
  const Parsed rest = parsed.config ? parsed : parse_as_elsewhere(of_node);
  if (!rest.config) return code;
  if (code != 0) std::puts("The rest of the file means:");
  print(stdout, explain(*rest.config));
  for (const auto& warning : assembly.warnings) print(stdout, "warning: " + warning);
  return code;
}

int explain_file(const std::string& file, const std::string& asked_role,
                 const RightQuestion& question) {
  if (const std::string problem = problem_of(question); !problem.empty()) {
    std::fprintf(stderr, "%s: expected %s\n", (question.name + " " + question.type).c_str(),
                 problem.c_str());
    return kExitConfiguration;
  }
  const OfNode of_node = read_for_node(file, asked_role);
  if (!of_node.problems.empty()) return report(file, of_node.problems);
  const Parsed parsed = parse_as_elsewhere(of_node);
  if (!parsed.config) {
    std::vector<std::string> problems;
    for (const auto& problem : parsed.problems) problems.push_back(to_text(problem));
    return report(file, problems);
  }
  print(stdout, explain_right(*parsed.config, question));
  return 0;
}

}  // namespace connect_bridge
