#include "run/known_groups.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "auth/secret.hpp"
#include "auth/token_table.hpp"
#include "config/parameter.hpp"

namespace connect_bridge {
namespace {

// What a login by each token of one identity would bring.
struct TokensOf {
  std::size_t count = 0;
  std::vector<std::string> groups;
};

void add_group(std::vector<std::string>& groups, const std::string& name) {
  if (std::find(groups.begin(), groups.end(), name) == groups.end()) groups.push_back(name);
}

// The text is one that TokenTable takes.
TokensOf tokens_of(const std::string& text, const std::string& identity) {
  TokensOf tokens;
  const YAML::Node entries = YAML::Load(text);
  if (!entries.IsSequence()) return tokens;  // one token: its identity has no groups
  for (const auto& entry : entries) {
    if (entry["identity"].Scalar() != identity) continue;
    ++tokens.count;
    const YAML::Node groups = entry["groups"];
    if (!groups) continue;
    if (groups.IsScalar()) add_group(tokens.groups, groups.Scalar());
    for (const auto& group : groups) add_group(tokens.groups, group.Scalar());
  }
  return tokens;
}

std::string groups_text(const TokensOf& tokens, const std::string& file) {
  const std::string of_all =
      tokens.count > 1 ? " (of all " + std::to_string(tokens.count) + " tokens together)" : "";
  return (tokens.groups.empty() ? "none" : to_text(ParameterValue{tokens.groups})) + ", as " +
         file + " has it" + of_all;
}

}  // namespace

KnownGroups known_groups(const Config& config, const std::string& identity) {
  const std::string whose = "groups of " + identity + ": ";
  const std::string none = whose + "none given (--group)";
  const std::string& file = config.auth.token_file;
  if (config.role != Role::kServer || config.auth.method != "token" || file.empty())
    return {{}, none};
  std::string problem;
  auto text = read_secret_file(file, problem);
  if (!text) return {{}, none + "; " + problem};
  TokenTable table;
  std::vector<std::string> problems, warnings;
  // The time does not matter: a token that has expired still shows the groups.
  table.read(*text, file, 0, problems, warnings);
  TokensOf tokens;
  if (problems.empty()) tokens = tokens_of(*text, identity);
  wipe(*text);
  if (!problems.empty()) return {{}, none + "; " + problems.front()};
  if (!table.knows(identity)) return {{}, none + "; " + file + " has no such identity"};
  std::string line = whose + groups_text(tokens, file);
  return {std::move(tokens.groups), std::move(line)};
}

}  // namespace connect_bridge
