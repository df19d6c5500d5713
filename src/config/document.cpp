#include "config/document.hpp"

#include <fmt/format.h>

#include "config/key_search.hpp"
#include "core/base/check.hpp"
#include "core/wire/login.hpp"
#include "version.hpp"

namespace connect_bridge {
namespace {

// The lines of the manual between which the tables stand.
constexpr std::string_view kBegin = "<!-- ctl config-doc writes from here -->\n";
constexpr std::string_view kEnd = "<!-- to here -->\n";

std::string used_by_text(UsedBy used_by) {
  return used_by == UsedBy::kServer ? "Server" : "Client";
}

// A bar would end the cell of the table. Backticks keep <name> from being read as HTML.
std::string code(std::string_view text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return "`" + escaped + "`";
}

// Words need no type: they show that the value is a string.
std::string value_text(const KeySpec& spec) {
  std::string text(type_text(spec.type));
  if (!spec.words.empty()) {
    const std::string words = fmt::format("`{}`", fmt::join(spec.words, "`, `"));
    return text == "string" ? words : text + ": " + words;
  }
  if (spec.range) text += fmt::format(", {:.15g} to {:.15g}", spec.range->min, spec.range->max);
  return spec.unit.empty() ? text : text + " " + spec.unit;
}

std::string row(const KeySpec& spec) {
  std::string help = spec.help;
  if (spec.used_by != UsedBy::kBoth) help = used_by_text(spec.used_by) + ". " + help;
  if (spec.secret) help += " Secret.";
  return fmt::format("| {}{} | {} | {} | {} |\n", code(spec.key), spec.changeable ? " *" : "",
                     value_text(spec), spec.fallback ? code(to_text(*spec.fallback)) : "", help);
}

// The most important parameters of a program, with their help texts.
std::string important(std::initializer_list<const char*> keys) {
  std::string text;
  for (const char* key : keys) {
    const KeySpec* spec = find_key(key);
    CONNECT_CHECK(spec != nullptr);
    text += fmt::format(
        "  {}{}\n      {}\n", key,
        spec->fallback ? fmt::format(" (default {})", to_text(*spec->fallback)) : "", spec->help);
  }
  return text;
}

ParameterDescriptor descriptor(const KeySpec& spec, std::string_view key) {
  ParameterDescriptor made;
  made.name = key;
  made.type = spec.type;
  made.description = spec.help;
  if (!spec.unit.empty()) made.description += " Unit: " + spec.unit + ".";
  if (!spec.changeable) made.description += " A change needs a restart.";
  made.constraints = expected_of(spec);
  made.range = spec.range;
  made.read_only = !spec.changeable;
  made.value = spec.fallback;
  return made;
}

constexpr char kServerHelp[] =
    R"(Usage: ros2 run connect_bridge server --ros-args --params-file FILE [-p KEY:=VALUE ...]

   or: ros2 run connect_bridge server --pair [HOST[:PORT]] [--operate] [--ros-args ...]
   or: ros2 run connect_bridge server --pair --via 'wss+relay://...' [--operate] [--ros-args ...]
   or: ros2 run connect_bridge server --pair [HOST[:PORT]] --drive [--ros-args ...]

The server of ROS2 Connect joins this ROS 2 graph with the graphs of its clients, over one WebSocket
each. Rules say which names are forwarded. Without rules none is.
With --pair the server makes a certificate and a login, and prints an invitation, which starts a
client on another machine, once. HOST is the name or address of this machine for clients. With --via
clients connect to a relay, and 'relay --robot' there prints the wss+relay://... (docs/reach.md).
Later both start without arguments.
A paired client may receive all topics but /rosout. With --operate it may also publish and call
everything: as much as a shell on the robot, since some services load code.
With --drive this end is the operator, and the robot connects: client --robot takes the invitation.

All settings are parameters of the ROS node, named connect_server. The most important ones:
{}
With this file everybody on this machine who has the token sees all topics:
  connect_server:
    ros__parameters:
      auth: {{token_file: robot.token}}
      rules: [see]
      rule:
        see: {{export_topics: ["/**"]}}
)";

constexpr char kClientHelp[] =
    R"(Usage: ros2 run connect_bridge client --ros-args --params-file FILE [-p KEY:=VALUE ...]

   or: ros2 run connect_bridge client 'wss+pair://...' [--ros-args ...]
   or: ros2 run connect_bridge client --robot [--operate] 'wss+pair://...' [--ros-args ...]

The client of ROS2 Connect connects to a server over one WebSocket. It joins this ROS 2 graph with
that of the server, as far as the rules of both sides allow, and connects again after each loss.
The invitation that 'server --pair' prints, in quotation marks, contains all that the client needs.
Later the client starts without arguments. With --robot this end is the robot, and 'server --pair
--drive' prints the invitation: the operator may receive all topics but /rosout. With --operate the
operator may also publish and call everything: as much as a shell on the robot, since some services
load code.

All settings are parameters of the ROS node, named connect_client. The most important ones:
{}
A client with this file imports what the server's rules allow, but /rosout, and exports topics:
  connect_client:
    ros__parameters:
      url: wss://robot.example:9090/
      auth: {{token_file: robot.token}}
)";

constexpr char kMoreHelp[] = R"(
`ctl check FILE` says in words what a parameter file means, `ctl config-doc` prints all parameters.
Other ROS arguments work as in every node: -r __node:=NAME, -r __ns:=/NAMESPACE, --log-level LEVEL.
--version prints version, protocol and build.
Manual: docs/config.md, docs/security.md and README.md of the project.
)";

}  // namespace

std::string config_tables() {
  std::string text, section;
  for (const KeySpec& spec : key_table()) {
    if (spec.section != section) {
      text += fmt::format("{}## {}\n\n", section.empty() ? "" : "\n", spec.section);
      text += "| key | value | default | meaning |\n";
      text += "| --- | --- | --- | --- |\n";
      section = spec.section;
    }
    text += row(spec);
  }
  return text;
}

std::optional<std::string> config_document(std::string_view manual) {
  const std::size_t begin = manual.find(kBegin);
  if (begin == std::string_view::npos) return std::nullopt;
  const std::size_t at = begin + kBegin.size();
  const std::size_t end = manual.find(kEnd, at);
  if (end == std::string_view::npos) return std::nullopt;
  return fmt::format("{}\n{}\n{}", manual.substr(0, at), config_tables(), manual.substr(end));
}

std::string version_text() {
  return fmt::format("connect_bridge {} (protocol {}; {})", kProgramVersion, kProtocolVersion,
                     kBuild);
}

std::string help_text(Role role) {
  if (role == Role::kServer) {
    return fmt::format(kServerHelp, important({"listen.address", "listen.port", "auth.token_file",
                                               "tls.certificate", "rules", "status_file"})) +
           kMoreHelp;
  }
  return fmt::format(kClientHelp,
                     important({"url", "auth.token_file", "tls.ca", "prefix", "rules"})) +
         kMoreHelp;
}

std::optional<ParameterDescriptor> describe_parameter(std::string_view key, Role role) {
  const KeySpec* spec = find_key(key);
  if (spec == nullptr || spec->secret || !is_used_by(*spec, role)) return std::nullopt;
  return descriptor(*spec, key);
}

std::vector<ParameterDescriptor> describe_parameters(const Config& config) {
  ParameterMap keys = config.given;
  std::vector<ParameterDescriptor> descriptors;
  for (const KeySpec& spec : key_table()) {
    if (rule_of(spec.key).empty()) keys.emplace(spec.key, false);
  }
  for (const auto& [key, unused] : keys) {
    auto found = describe_parameter(key, config.role);
    if (!found) continue;
    if (const auto given = config.given.find(key); given != config.given.end()) {
      found->value = value_to_show(*find_key(key), given->second);
    }
    descriptors.push_back(std::move(*found));
  }
  return descriptors;
}

}  // namespace connect_bridge
