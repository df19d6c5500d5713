#include "ctl/check.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "access/login/secret.hpp"
#include "access/login/token_table.hpp"
#include "config/explain.hpp"
#include "config/explain_right.hpp"
#include "config/syntax.hpp"
#include "core/ports/pin.hpp"
#include "core/wire/text.hpp"
#include "ops/doctor/host_check.hpp"
#include "ros/parameters/parameter_file.hpp"
#include "ros/rcl/missing_middleware.hpp"
#include "run/assembly.hpp"
#include "run/exit_codes.hpp"
#include "run/surroundings.hpp"

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

// A file for any node ("/**") is a client's if it has a url. Returns false if nothing shows the
// role.
bool find_role(const ros::ParameterFile& file, const std::string& asked, OfNode& of_node) {
  const Given server = parameters_for(file, kServerNode);
  const Given client = parameters_for(file, kClientNode);
  const bool has_url = client.parameters.contains("url");
  if (asked.empty() && !server.found && !client.found) return false;
  const bool is_client =
      asked.empty() ? client.found && (!server.found || has_url) : asked == "client";
  std::string why = has_url ? "it has a `url`" : "it has no `url`";
  if (!server.found || !client.found)
    why = is_client ? "it is for connect_client" : "it is for connect_server";
  of_node.role = is_client ? Role::kClient : Role::kServer;
  of_node.taken_as = is_client ? "checked as a client's file (" : "checked as a server's file (";
  of_node.taken_as += !asked.empty() ? "--role " + asked + ")"
                      : is_client    ? why + "); --role server for a server's"
                                     : why + "); --role client for a client's";
  return true;
}

int report(const std::string& file, const std::vector<std::string>& problems) {
  say(stderr, file + ": " + std::to_string(problems.size()) +
                  (problems.size() == 1 ? " problem" : " problems"));
  for (const auto& problem : problems) say(stderr, "  " + problem);
  return kExitConfiguration;
}

// A token or files that are missing on this machine do not change what the rest means.
Parsed parse_as_elsewhere(const ParameterMap& parameters, Role role) {
  Surroundings elsewhere;
  elsewhere.token_in_environment = true;
  return parse_config(parameters, role, elsewhere);
}

std::string groups_text(const TokenTable::Tokens& tokens, const std::string& file) {
  const std::string of_all =
      tokens.count > 1 ? " (of all " + std::to_string(tokens.count) + " tokens together)" : "";
  return (tokens.groups.empty() ? "none" : to_text(ParameterValue{tokens.groups})) + ", as " +
         file + " has it" + of_all;
}

struct KnownGroups {
  std::vector<std::string> groups;
  std::string text;  // a line for people: where they come from, or that none are known
};

// The groups of an identity, as far as the configuration names them: at a server those of all its
// tokens in auth.token_file, at a client those behind its key in tls.pin. Other login methods name
// groups only at a login.
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

struct Assembled {
  Assembly assembly;
  std::string not_loaded;  // a key; empty: all was
};

// A plugin is code, and an address gets a request: that of a file that may be somebody else's is
// neither executed nor sent, the more so as root.
Assembled assemble_harmless(Config config, const std::string& node) {
  Assembled result;
  const bool is_server = config.role == Role::kServer;
  const bool is_plugin = is_server && config.auth.method == "plugin";
  if (is_plugin) result.not_loaded = "auth.plugin";
  if (is_server && config.auth.method == "jwt" &&
      syntax::parse_http_url(config.auth.option("jwt_keys")))
    result.not_loaded = "auth.jwt_keys";
  if (!result.not_loaded.empty()) config.auth.method = "none";
  result.assembly = assemble(config, node);
  return result;
}

}  // namespace

void say(std::FILE* to, std::string_view lines) {
  while (!lines.empty()) {
    const std::string_view line = lines.substr(0, lines.find('\n'));
    std::fprintf(to, "%s\n", to_text(line, line.size()).c_str());
    lines.remove_prefix(std::min(line.size() + 1, lines.size()));
  }
}

OfNode read_for_node(const std::string& file, const std::string& asked_role) {
  OfNode result;
  const ros::ParameterFile read = ros::read_parameter_file(file);
  for (const std::string& problem : read.problems) result.problems.push_back({read.cause, problem});
  if (!result.problems.empty()) return result;
  if (!find_role(read, asked_role, result)) {
    result.problems = {
        {Cause::kSectionMissing,
         "no parameters for connect_server or connect_client; for a node with another name give "
         "--role server or --role client"}};
    return result;
  }
  result.node = result.role == Role::kServer ? kServerNode : kClientNode;
  Given given = parameters_for(read, result.node);
  if (!given.found && read.sections.size() == 1) given.parameters = read.sections[0].parameters;
  result.parameters = std::move(given.parameters);
  return result;
}

FileJudged judge_file(const std::string& file, const std::string& role) {
  FileJudged judged{read_for_node(file, role), {}, {}, {}, {}};
  const OfNode& given = judged.given;
  std::vector<Failure>& problems = judged.given.problems;
  if (!problems.empty()) return judged;
  Parsed parsed = parse_config(given.parameters, given.role, surroundings());
  for (const auto& problem : parsed.problems) problems.push_back(failure_of(problem));
  HostFindings host = check_host(given.parameters);
  append(problems, host.problems);
  append(problems, host.ended);
  if (parsed.config) {
    Assembled assembled = assemble_harmless(*parsed.config, given.node);
    const std::string others = who_may_change_rules(*parsed.config, {file});
    if (!others.empty() && parsed.config->reached_by_others)
      problems.push_back({Cause::kFileDistrusted, others});
    else if (!others.empty())
      host.warnings.push_back({Cause::kFileDistrusted, others});
    append(problems, assembled.assembly.problems);
    for (std::string& text : assembled.assembly.warnings)
      judged.warnings.push_back({Cause::kOther, std::move(text)});
    judged.not_loaded = std::move(assembled.not_loaded);
  }
  append(judged.warnings, host.warnings);
  judged.hints = std::move(host.hints);
  judged.config = std::move(parsed.config);
  return judged;
}

int check_file(const std::string& file, const std::string& asked_role) {
  FileJudged judged = judge_file(file, asked_role);
  if (const auto missing = ros::missing_middleware())
    judged.given.problems.push_back(
        {Cause::kOther, "the RMW is not installed (" + to_text(*missing) +
                            "): install its package, or unset " + missing->variable});
  const OfNode& given = judged.given;
  if (given.node.empty()) return report(file, texts_of(given.problems));
  say(given.problems.empty() ? stdout : stderr, given.taken_as);
  const int code = given.problems.empty() ? 0 : report(file, texts_of(given.problems));
  std::optional<Config> rest = judged.config;
  if (!rest) rest = parse_as_elsewhere(given.parameters, given.role).config;
  if (!rest) return code;
  if (code != 0) std::puts("The rest of the file means:");
  say(stdout, explain(*rest));
  if (!judged.not_loaded.empty()) say(stdout, judged.not_loaded + ": not loaded by ctl check");
  for (const auto& warning : judged.warnings) say(stdout, "warning: " + warning.text);
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
  if (!of_node.problems.empty()) return report(file, texts_of(of_node.problems));
  const Parsed parsed = parse_as_elsewhere(of_node.parameters, of_node.role);
  if (!parsed.config) {
    std::vector<std::string> problems;
    for (const auto& problem : parsed.problems) problems.push_back(to_text(problem));
    return report(file, problems);
  }
  RightQuestion asked = question;
  if (!asked.who.name.empty() && asked.who.groups.empty()) {
    KnownGroups known = known_groups(*parsed.config, asked.who.name);
    asked.who.groups = std::move(known.groups);
    say(stdout, known.text);
  }
  const RightAnswer answer = explain_right(*parsed.config, asked);
  say(stdout, answer.text);
  return answer.allowed ? 0 : kExitNotAllowed;
}

}  // namespace connect_bridge
