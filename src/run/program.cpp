#include "run/program.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <iostream>
#include <optional>
#include <string_view>

#include "access/pairing/arguments.hpp"
#include "access/pairing/invitation_text.hpp"
#include "access/pairing/pairing.hpp"
#include "config/document.hpp"
#include "config/key_search.hpp"
#include "net/tcp/descriptors.hpp"
#include "ops/doctor/host_check.hpp"
#include "ros/parameters/parameter_arguments.hpp"
#include "ros/parameters/ros_arguments.hpp"
#include "ros/rcl/middleware.hpp"
#include "run/assembly.hpp"
#include "run/bridge.hpp"
#include "run/exit_codes.hpp"
#include "run/heap.hpp"
#include "run/own_arguments.hpp"
#include "run/signals.hpp"
#include "run/slow_start.hpp"

namespace connect_bridge {
namespace {

const char* default_name(Role role) {
  return role == Role::kServer ? "connect_server" : "connect_client";
}

constexpr char kNoServerOfOurs[] =
    "A server that was started from this user's pairing folder would take the client. End what "
    "listens there, or give this one another port.";

int refuse(const std::vector<std::string>& problems, const char* hint = "") {
  std::fprintf(stderr, "Not started: %zu problem%s in the configuration:\n", problems.size(),
               problems.size() == 1 ? "" : "s");
  for (const auto& problem : problems) std::fprintf(stderr, "  %s\n", problem.c_str());
  if (*hint != '\0') std::fprintf(stderr, "%s\n", hint);
  return kExitConfiguration;
}

// A renamed node finds no parameters in a file that is written for the default name.
bool has_default_section(const ros::NodeFacts& facts, Role role) {
  const auto& others = facts.others_with_parameters;
  return std::any_of(others.begin(), others.end(),
                     [&](const auto& other) { return other.ends_with(default_name(role)); });
}

// All other sections are named: one may be ours, with a misspelt name.
std::string other_sections(const ros::NodeFacts& facts) {
  return fmt::format("the parameter file has nothing for {0}, only for {1}: write {0} or /** there",
                     facts.full_name, fmt::join(facts.others_with_parameters, ", "));
}

bool says_nothing(const ParameterMap& given) {
  return std::all_of(given.begin(), given.end(), [](const auto& p) { return is_ros_key(p.first); });
}

std::optional<Config> read_config(const ros::Node& node, Role role, const ParameterMap& given,
                                  std::vector<std::string>& problems) {
  const ros::NodeFacts& facts = node.facts();
  const bool has_default = has_default_section(facts, role);
  const bool is_empty = says_nothing(given);
  Parsed parsed = parse_config(given, role, surroundings());
  const bool is_wrong = !parsed.problems.empty();
  const bool is_for_others = is_empty && !facts.others_with_parameters.empty();
  if (has_default ? is_empty || is_wrong : is_for_others && is_wrong)
    problems.push_back(other_sections(facts));
  if (has_default && is_empty) return std::nullopt;  // the missing parameters are in that section
  for (const auto& problem : parsed.problems) problems.push_back(to_text(problem));
  return problems.empty() ? std::move(parsed.config) : std::nullopt;
}

// Finds one of `words` among the arguments that are not for ROS.
bool has_argument(int argc, char** argv, std::initializer_list<std::string_view> words) {
  bool for_ros = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument(argv[i]);
    if (argument == "--ros-args" || argument == "--") {
      for_ros = argument == "--ros-args";
    } else if (!for_ros && std::find(words.begin(), words.end(), argument) != words.end()) {
      return true;
    }
  }
  return false;
}

// rcl names no cure for a misspelt option. Others are left to it.
std::vector<std::string> misspelt_options(int argc, char** argv) {
  std::vector<std::string> problems;
  for (const std::string& given : ros::unknown_options(argc, argv))
    if (const std::string meant = nearest_of(ros::long_options(), given); !meant.empty())
      problems.push_back("unknown ROS argument " + given + ": did you mean " + meant + "?");
  return problems;
}

// The socket of the supervisor. Empty: no supervisor waits for this process. Systemd names the
// process that it has started; if that is another one, such as `ros2 launch`, it reports for
// itself.
std::string notify_socket() {
  const char* const socket = std::getenv("NOTIFY_SOCKET");
  const char* const whose = std::getenv("SYSTEMD_EXEC_PID");
  if (socket == nullptr || (whose != nullptr && whose != std::to_string(::getpid()))) return {};
  return socket;
}

// Begins the last steps before the destructor of the bridge, which was made earlier. The bridge's
// destructor waits for threads, which a plugin or the middleware may block.
struct BeginsLastSteps {
  LastSteps& last_steps;
  ~BeginsLastSteps() { last_steps.begin(); }
};

// Prints the invitation to the standard output, not to the log: it holds a secret. Returns the
// problem; empty: none.
std::string print_invitation(const Start& start, std::uint16_t port) {
  std::string problem;
  const std::string text =
      invitation_to_print(*start.invitation, port, ::isatty(STDOUT_FILENO) == 1,
                          start.folder->invitation_file(), problem);
  std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
  return problem;
}

int invite_to_running(const ros::Node& node, const Start& start) {
  if (const std::string wrong = invite(start); !wrong.empty()) return refuse({wrong});
  for (const auto& line : start.news) node.log(LogLevel::kInfo, line);
  const std::string problem = print_invitation(start, start.running->port);
  return problem.empty() ? 0 : refuse({problem});
}

int start(ros::Node& node, Role role, LastSteps& last_steps) {
  const ros::NodeFacts& facts = node.facts();
  const Arguments arguments = read_arguments(facts.arguments, role);
  const Start start = start_with(facts.parameter_overrides, arguments, facts.full_name);
  if (!start.problems.empty()) return refuse(start.problems);
  if (start.running) return invite_to_running(node, start);
  std::vector<std::string> problems;
  const auto config = read_config(node, role, start.parameters, problems);
  const HostFindings host = check_host(start.parameters);
  append(problems, texts_of(host.problems));
  if (!config && says_nothing(start.parameters) && facts.others_with_parameters.empty())
    return refuse(problems,
                  role == Role::kServer
                      ? "To start without parameters: server --pair; at an operator to whom robots "
                        "connect: server --pair --drive"
                      : "To start without parameters: the invitation that 'server --pair' prints");
  if (!config) return refuse(problems);
  const std::string others = who_may_change_rules(*config, facts.parameter_files);
  if (!others.empty() && config->reached_by_others) problems.push_back(others);
  Assembly assembly = assemble(*config, facts.full_name, start);
  append(problems, texts_of(assembly.problems));
  if (!problems.empty()) return refuse(problems);
  const std::string no_sockets = take_sockets(*assembly.parts);
  if (!no_sockets.empty()) return refuse({no_sockets});
  assembly.parts->side.qos_must_fit = !ros::middleware().joins_any_qos;
  assembly.parts->notify_socket = notify_socket();
  hide_environment();
  for (const auto& line : start.news) node.log(LogLevel::kInfo, line);
  for (const auto& warning : config->warnings) node.log(LogLevel::kWarn, warning);
  for (const auto& warning : assembly.warnings) node.log(LogLevel::kWarn, warning);
  if (!others.empty()) node.log(LogLevel::kWarn, others);
  Bridge bridge(node, std::move(*assembly.parts));
  const BeginsLastSteps at_the_end{last_steps};
  std::string problem = bridge.open();
  if (!problem.empty()) return refuse({problem}, arguments.pairs ? kNoServerOfOurs : "");
  if (start.keep && start.relay_code.empty()) problem = start.keep();
  if (problem.empty() && start.invitation) problem = invite(start);
  if (!problem.empty()) return refuse({problem});
  std::optional<RunningMark> mark;
  if (role == Role::kServer && start.folder)
    mark.emplace(start.folder->running_file(), bridge.port());
  if (start.invitation) problem = print_invitation(start, bridge.port());
  if (!problem.empty()) return refuse({problem});
  try {
    bridge.run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "Ended by an error while running: %s\n", error.what());
    return kExitFailed;
  }
  return bridge.exit_code();
}

}  // namespace

int run_program(Role role, int given_count, char** given) {
  OwnArguments own(given_count, given);
  if (has_argument(own.count(), own.words(), {"--help", "-h"})) {
    std::fputs(help_text(role).c_str(), stdout);
    return 0;
  }
  if (has_argument(own.count(), own.words(), {"--version"})) {
    std::printf("%s\n", version_text().c_str());
    return 0;
  }
  if (const std::string problem = own.read_from(std::cin); !problem.empty())
    return refuse({problem});
  const int argc = own.count();
  char** const argv = own.words();
  std::signal(SIGPIPE, SIG_IGN);
  ignore_early_hangup();
  raise_descriptors();
  auto wrong = ros::problems_of_parameters(argc, argv);
  append(wrong, ros::problems_of_remaps(argc, argv));
  append(wrong, misspelt_options(argc, argv));
  if (!wrong.empty()) return refuse(wrong);
  tune_heap();
  LastSteps last_steps;
  try {
    ros::NodeOptions options;
    options.name = default_name(role);
    options.argc = argc;
    options.argv = argv;
    options.publishes_images = [role](const ros::NodeFacts& known) {
      return robot_end(known.parameter_overrides, read_arguments(known.arguments, role),
                       known.full_name) != role;  // published at the operator
    };
    auto slow = says_if_slow(kSlowStartPatience, [] { std::fputs(kSlowStartText, stderr); });
    ros::Node node(options);
    slow = {};
    return start(node, role, last_steps);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "Not started: %s\n", error.what());
    return kExitRos;
  }
}

}  // namespace connect_bridge
