#include "run/known_groups.hpp"

#include <utility>

#include "auth/secret.hpp"
#include "auth/token_table.hpp"
#include "config/parameter.hpp"
#include "core/ports/pin.hpp"

namespace connect_bridge {
namespace {

std::string groups_text(const TokenTable::Tokens& tokens, const std::string& file) {
  const std::string of_all =
      tokens.count > 1 ? " (of all " + std::to_string(tokens.count) + " tokens together)" : "";
  return (tokens.groups.empty() ? "none" : to_text(ParameterValue{tokens.groups})) + ", as " +
         file + " has it" + of_all;
}

}  // namespace

KnownGroups known_groups(const Config& config, const std::string& identity) {
  const std::string whose = "groups of " + identity + ": ";
  const std::string none = whose + "none given (--group)";
  if (config.role == Role::kClient) {
    for (const std::string& entry : config.tls.pins)
      if (Identity server = pin_in(entry).is; server.name == identity) {
        std::string line = whose + to_text(ParameterValue{server.groups}) + ", as tls.pin has it";
        return {std::move(server.groups), std::move(line)};
      }
  }
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
  wipe(*text);
  if (!problems.empty()) return {{}, none + "; " + problems.front()};
  TokenTable::Tokens tokens = table.of_identity(identity);
  if (tokens.count == 0) return {{}, none + "; " + file + " has no such identity"};
  std::string line = whose + groups_text(tokens, file);
  return {std::move(tokens.groups), std::move(line)};
}

}  // namespace connect_bridge
