#include "access/pairing/pairing.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>

#include "access/login/pairing_login.hpp"
#include "access/login/secret.hpp"
#include "access/login/token_file.hpp"
#include "access/login/token_table.hpp"
#include "access/pairing/pairing_folder.hpp"
#include "access/pairing/pairing_rules.hpp"
#include "config/key_search.hpp"
#include "config/syntax.hpp"
#include "core/base/close_code.hpp"
#include "core/base/hex.hpp"
#include "core/ports/url.hpp"
#include "net/tcp/own_address.hpp"
#include "net/tls/authority.hpp"

namespace connect_bridge {
namespace {

constexpr std::int64_t kPort = 9090;

std::string host_name() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

std::string news_of(const PairingFolder& folder) {
  return (folder.has("params.yaml") ? "using the pairing in " : "creating the pairing in ") +
         folder.parameter_file();
}

// ---- both

// The token in the file, which is created if needed; empty: `problem` has the reason.
std::string kept_token(const std::string& file, std::string& problem) {
  if (::access(file.c_str(), F_OK) != 0) {
    const std::string token = random_token();
    problem =
        token.empty() ? "no random numbers are available" : write_secret_file(file, token + "\n");
    if (problem.empty()) return token;
    return {};
  }
  const std::string token{trim(read_secret_file(file, problem).value_or(""))};
  if (problem.empty()) {
    problem = token_problem(token);
    if (!problem.empty()) problem = file + ": " + problem;
  }
  return problem.empty() ? token : std::string{};
}

// ---- server

// The groups of paired clients: all of them, and those that were paired with --operate.
constexpr char kPaired[] = "paired";
constexpr char kOperators[] = "operators";

// The default parameters of a paired server. At the robot every paired client may look; operators
// may also publish, call services, send goals and set parameters. An operator's server needs no
// rules: it imports what the robots allow.
ParameterMap server_parameters(const PairingFolder& folder, Role robot) {
  ParameterMap all{{"listen.address", std::string{"*"}},
                   {"listen.port", kPort},
                   {"tls.certificate", folder.file("server.crt")},
                   {"tls.private_key", folder.file("server.key")},
                   {"auth.token_file", folder.file("tokens.yaml")}};
  if (robot == Role::kClient) {
    all["robot"] = std::string{"client"};
    return all;
  }
  all.merge(robot_rules(true));
  all["rule.look.groups"] = std::vector<std::string>{kPaired};
  all["rule.operate.groups"] = std::vector<std::string>{kOperators};
  return all;
}

// The parameters for the next start without arguments: given addresses and a given prefix stay.
ParameterMap lasting(const ParameterMap& given, const ParameterMap& stored) {
  ParameterMap listening;
  for (const auto& entry : given)
    if (entry.first.starts_with("listen.") || entry.first == "prefix") listening.insert(entry);
  return filled(listening, stored);
}

// The parameters of an earlier pairing, or new ones; without rules if rules are given.
ParameterMap stored_or_new(const PairingFolder& folder, const ParameterMap& given, Role robot,
                           std::string& problem) {
  ParameterMap stored = folder.parameters(problem);
  if (problem.empty()) problem = folder.other_kind(stored, robot);
  if (!stored.empty()) return stored;
  stored = server_parameters(folder, robot);
  if (given.contains("rules"))
    std::erase_if(stored, [](const auto& entry) { return entry.first.starts_with("rule"); });
  return stored;
}

// The name in the certificate. Clients trust it by the digest of its key, so any name will do.
std::string certified_name() {
  const std::string name = pairing_name(host_name());
  return name.front() == '-' || name.front() == '.' ? "server" : name;
}

std::string make_server_files(const PairingFolder& folder) {
  std::string problem = folder.make();
  if (problem.empty() && !folder.has("server.crt"))
    problem = make_pinned_certificate(folder.path(), certified_name());
  if (problem.empty() && !folder.has("tokens.yaml"))
    problem = write_secret_file(folder.file("tokens.yaml"),
                                "# Clients that have paired with this server.\n");
  return problem;
}

// The URL for clients, without a port if the port is not known before the server listens.
std::string dialed(const ParameterMap& parameters, const std::string& host) {
  const std::string relay = string_at(parameters, "listen.relay.url");
  if (host.empty() && !relay.empty()) return relay.substr(0, relay.rfind('/')) + "/";
  std::string authority = host;
  if (authority.empty()) {
    authority = syntax::listen_addresses(string_at(parameters, "listen.address")).front();
    for (const char* all : {"*", "0.0.0.0", "::", "systemd"})
      if (authority == all) authority = own_address();
    authority = bracketed(authority);
  }
  return "wss://" + authority + "/";
}

std::string text_of(const RunningServer& running, const PairingFolder& folder) {
  return "a server runs already with the pairing in " + folder.path() + " (process " +
         std::to_string(running.process) + ", port " + std::to_string(running.port) + ")";
}

std::string end_or_name() {
  return std::string{"end it first, or "} + kOwnName;
}

// Two robots with unchanged names would be one here: /scan of both is one topic, and only one of
// two equal services is called. An operator with one robot wants /tf to be /tf, so only a second
// robot needs a prefix.
std::string second_robot(const PairingFolder& folder, const std::string& prefix) {
  if (prefix == syntax::kByIdentity) return {};
  const std::string file = folder.file("tokens.yaml");
  std::string problem;
  const auto text = read_secret_file(file, problem);
  TokenTable robots;
  std::vector<std::string> problems, warnings;
  if (text) robots.read(*text, file, 0, problems, warnings);
  if (robots.size() == 0) return {};
  return "this server has a robot already, of which another one's names could not be told. For "
         "several robots, end this server, and begin once with server --pair --drive --ros-args "
         "-p prefix:=by_identity: then /scan of each is below its name, /ROBOT/scan, also of the "
         "first. If the one before is gone: ctl token IDENTITY --remove --file '" +
         file + "', with its identity in that file";
}

// The running server takes the client: parameters of this process would have no effect.
std::string go_to_running(const PairingFolder& folder, bool by_relay, Start& start) {
  const std::string which = text_of(*start.running, folder);
  const bool says_more = std::any_of(start.parameters.begin(), start.parameters.end(),
                                     [](const auto& given) { return !is_ros_key(given.first); });
  if (says_more || by_relay)
    return which + ", and gets no other parameters: leave them out to invite a client to it, " +
           end_or_name();
  start.news.push_back(which + ": it takes the client that pairs");
  return {};
}

// Adds the relay of a registration command. By default the server is then connected to the relay
// alone.
void add_relay(const std::string& text, const PairingFolder& folder, Start& start,
               std::string& problem) {
  const Invitation line = parse_relay_line(text, problem);
  const std::string file = folder.token_file("relay", line.code);
  if (problem.empty()) static_cast<void>(kept_token(file, problem));
  start.relay_code = line.code;
  start.parameters =
      filled(start.parameters, {{"listen.address", std::string{"127.0.0.1"}},
                                {"listen.relay.url", line.url},
                                {"listen.relay.token_file", file},
                                {"listen.relay.pin", std::vector<std::string>{line.pin}}});
}

void pair_server(const Arguments& arguments, const PairingFolder& folder, Start& start) {
  if (!goes_by_pairing(start.parameters) || start.parameters.contains("robot")) {
    start.problems.emplace_back(
        "--pair makes the certificate and the login itself, and --drive says which end is the "
        "robot: leave out tls.*, auth.*, robot and the token in the environment, or make a token "
        "with 'ctl token'");
    return;
  }
  const bool drives = arguments.robot == Role::kClient;
  std::string problem = make_server_files(folder);
  const ParameterMap stored =
      problem.empty() ? stored_or_new(folder, start.parameters, arguments.robot, problem)
                      : ParameterMap{};
  if (problem.empty() && drives)
    problem = second_robot(folder, string_at(filled(start.parameters, stored), "prefix"));
  start.running = folder.running();
  if (problem.empty() && start.running) {
    problem = go_to_running(folder, !arguments.via.empty(), start);
  } else if (problem.empty() && !arguments.via.empty()) {
    add_relay(arguments.via, folder, start, problem);
  }
  if (problem.empty()) {
    const ParameterMap next = lasting(start.parameters, stored);
    if (next != stored || !folder.has("params.yaml"))
      start.keep = [folder, stored, next] {
        constexpr char kToken[] = "listen.relay.token_file";
        std::string wrong = folder.write_parameters(next);
        if (wrong.empty())
          folder.remove_former("relay", string_at(stored, kToken), string_at(next, kToken));
        return wrong;
      };
    start.parameters = filled(start.parameters, stored);
  }
  Invitation invitation;
  invitation.invites_robot = drives;
  if (problem.empty()) {
    invitation.pin = pin_of_file(string_at(start.parameters, "tls.certificate"), problem);
    invitation.url = dialed(start.parameters, arguments.host);
    invitation.code = random_token().substr(0, kCodeSize);
    if (invitation.code.empty()) problem = "no random numbers are available";
  }
  if (!problem.empty()) return start.problems.push_back("--pair: " + problem);
  std::string wrong;
  static_cast<void>(parse_invitation(to_text(invitation), wrong));
  const bool names_robot = arguments.host.find('@') != std::string::npos;  // a relay's URL has it
  if (!wrong.empty() || names_robot)
    return start.problems.push_back("--pair \"" + arguments.host +
                                    "\": expected a host name or address, with or without a port");
  if (!start.running) start.news.push_back(news_of(folder));
  start.groups = {kPaired};
  if (drives)
    start.news.emplace_back(
        "a robot that pairs may receive all topics of this graph and publish any in it, unless "
        "you add rules");
  if (arguments.operates) {
    start.groups.emplace_back(kOperators);
    start.news.emplace_back(
        "the client that pairs joins the group 'operators': unless you change the rules it may "
        "publish, call, send goals and set parameters: as much as a shell on this robot");
  }
  start.invitation = std::move(invitation);
}

// ---- client

constexpr char kOperatorName[] = "operator";

std::string keep(const PairingFolder& folder, const ParameterMap& parameters) {
  std::string problem;
  const ParameterMap stored = folder.parameters(problem);
  const std::string former = string_at(stored, "auth.token_file");
  if (problem.empty()) problem = folder.write_parameters(filled(parameters, stored));
  // This token was for the server that this client was paired with before.
  if (problem.empty())
    folder.remove_former("token", former, string_at(parameters, "auth.token_file"));
  return problem;
}

// The check of second_robot(), for an operator's end that is the client.
std::string robot_of_same_names(const PairingFolder& folder, const std::string& prefix) {
  const std::string other = folder.other_client(prefix);
  if (other.empty()) return {};
  return "a client is paired with another robot, in " + other +
         ", and /scan of both would be one topic here. Give this one a name and a prefix, behind "
         "the invitation: --ros-args -r __node:=robot2 -p prefix:=/robot2. If that robot is gone, "
         "remove its folder";
}

void join(const Invitation& invitation, const Arguments& arguments, const PairingFolder& folder,
          Start& start) {
  if (!goes_by_pairing(start.parameters) || start.parameters.contains("robot")) {
    start.problems.emplace_back(
        "an invitation contains address, certificate and login, and says which end is the robot: "
        "leave out url, tls.*, auth.*, robot and the token in the environment");
    return;
  }
  const bool is_robot = arguments.robot == Role::kClient;
  const std::string file = folder.token_file("token", invitation.code);
  ParameterMap paired{{"url", invitation.url},
                      {"tls.pin", std::vector<std::string>{invitation.pin}},
                      {"auth.token_file", file}};
  // The robot's rules and its audit log use this name for the operator.
  if (is_robot) paired["tls.pin"] = std::vector<std::string>{invitation.pin + " " + kOperatorName};
  std::string problem = two_of_a_kind(invitation, is_robot);
  if (problem.empty()) problem = folder.make();
  const ParameterMap stored = problem.empty() ? folder.parameters(problem) : ParameterMap{};
  if (problem.empty()) problem = folder.other_kind(stored, arguments.robot);
  const bool own_rules = is_robot && has_own_rules(stored);
  if (is_robot) {
    paired["robot"] = std::string{"client"};
    paired.merge(own_rules ? rules_of(stored) : robot_rules(arguments.operates));
  }
  const std::string former = string_at(stored, "auth.token_file");
  const bool is_paired = former == file;  // this invitation was used here already
  if (problem.empty() && !is_robot && !is_paired)
    problem = robot_of_same_names(folder, string_at(filled(start.parameters, stored), "prefix"));
  const std::string token = problem.empty() ? kept_token(file, problem) : "";
  if (problem.empty() && is_paired && arguments.operates &&
      !stored.contains("rule.operate.import_topics"))
    problem = "this robot has paired already, without --operate: add a rule to " +
              folder.parameter_file() + ", or pair it again, with another invitation";
  const auto prefix = start.parameters.find("prefix");
  if (prefix != start.parameters.end()) paired.insert(*prefix);
  if (!problem.empty()) return start.problems.push_back("pairing: " + problem);
  start.parameters = filled(start.parameters, is_paired ? stored : paired);
  if (is_paired) return;
  start.joining = Joining{
      pairing_credential(invitation.code, sha256(view_of(token)), pairing_name(host_name())),
      {token.begin(), token.end()},
      [folder, paired] { return keep(folder, paired); },
      is_robot ? "server --pair --drive" : "server --pair"};
  start.news.push_back("pairing with " + invitation.url);
  if (!former.empty()) start.news.emplace_back("this replaces the former pairing");
  if (own_rules)
    start.news.push_back("your rules in " + folder.parameter_file() +
                         " stay: they say what its operator may do here");
  else if (is_robot)
    start.news.emplace_back(
        arguments.operates
            ? "its operator may receive topics, publish, call, send goals and set parameters here, "
              "unless you change the rules: as much as a shell on this robot"
            : "its operator may receive topics, and do nothing here (--operate allows the rest)");
}

PairingFolder folder_of(const std::string& node, const ParameterMap& given) {
  // The given parameters decide on this, not those in the folder itself.
  const auto strict = given.find("strict_modes");
  return PairingFolder(node, strict == given.end() || strict->second != ParameterValue{false});
}

}  // namespace

Role robot_end(const ParameterMap& given, const Arguments& arguments, const std::string& node) {
  if (arguments.pairs || !arguments.invitation.empty()) return arguments.robot;
  std::string unread;
  const ParameterMap all =
      goes_by_pairing(given) ? filled(given, folder_of(node, given).parameters(unread)) : given;
  return string_at(all, "robot") == "client" ? Role::kClient : Role::kServer;
}

Start start_with(const ParameterMap& given, const Arguments& arguments, const std::string& node) {
  Start start;
  start.problems = arguments.problems;
  start.parameters = given;
  if (!start.problems.empty()) return start;
  const PairingFolder folder = folder_of(node, given);
  std::string problem;
  if (arguments.pairs) {
    start.folder = folder;
    pair_server(arguments, folder, start);
  } else if (!arguments.invitation.empty()) {
    const Invitation invitation = parse_invitation(arguments.invitation, problem);
    if (problem.empty()) {
      start.folder = folder;
      join(invitation, arguments, folder, start);
    }
  } else if (goes_by_pairing(given) && folder.has("params.yaml")) {
    start.folder = folder;
    start.parameters = filled(given, folder.parameters(problem));
    if (const auto running = folder.running(); running && problem.empty())
      problem = text_of(*running, folder) + ": " + end_or_name();
    start.news.push_back(news_of(folder));
  }
  if (!problem.empty()) start.problems.push_back(problem);
  return start;
}

std::string invite(const Start& start) {
  const std::string wrong =
      write_invited(start.folder->invited_file(), start.invitation->code, start.groups);
  return wrong.empty() ? "" : "--pair: " + wrong;
}

std::string refused_invitation(const Joining& joining, std::optional<std::uint16_t> close_code) {
  if (close_code != static_cast<std::uint16_t>(CloseCode::kLoginRefused)) return {};
  return "the server refused the invitation: its code is wrong, was used already or is too old. '" +
         joining.made_by + "' makes another one there";
}

}  // namespace connect_bridge
