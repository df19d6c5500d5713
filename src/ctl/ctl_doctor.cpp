#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "access/login/runtime_folder.hpp"
#include "access/login/token_table.hpp"
#include "config/syntax.hpp"
#include "core/ports/url.hpp"
#include "core/wire/text.hpp"
#include "ctl/check.hpp"
#include "ctl/ctl_asked.hpp"
#include "ctl/ctl_commands.hpp"
#include "ctl/ctl_programs.hpp"
#include "ctl/probe.hpp"
#include "ctl/status_text.hpp"
#include "net/tcp/system_now.hpp"
#include "ops/doctor/diagnosis.hpp"
#include "ops/doctor/host_check.hpp"
#include "ops/doctor/status_diagnosis.hpp"
#include "ops/status/json_members.hpp"
#include "ros/rcl/missing_middleware.hpp"
#include "run/assembly.hpp"
#include "run/exit_codes.hpp"
#include "run/surroundings.hpp"

namespace {

using namespace connect_bridge;

struct DoctorOrder {
  // A file, a URL, an address of a status or a socket; empty: what runs here.
  std::string what;
  std::string role;
  std::string token_file, ca, pin;  // for a URL
  bool offline = false;
  bool json = false;
  bool list = false;
};

constexpr auto kPatienceOfDoctor = std::chrono::seconds(15);
constexpr int kSomethingWrong = 1;
constexpr std::size_t kNameBytes = 100;
constexpr std::size_t kSeenBytes = 300;
constexpr const char* kVariables[] = {"ROS_DOMAIN_ID", "RMW_IMPLEMENTATION",
                                      "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"};

bool is_asked(const std::string& variable) {
  const auto is = [&](const char* name) { return variable == name; };
  return std::any_of(std::begin(kVariables), std::end(kVariables), is) ||
         std::any_of(std::begin(kMiddlewareVariables), std::end(kMiddlewareVariables), is);
}

void add_found(std::vector<Found>& to, std::vector<Found> from, const std::string& subject = {}) {
  for (Found& found : from) {
    if (found.subject.empty()) found.subject = subject;
    to.push_back(std::move(found));
  }
}

// The variables that count in an environment as /proc shows it: NAME=value, each with a zero at its
// end.
std::map<std::string, std::string> variables_in(const std::string& environment) {
  std::map<std::string, std::string> found;
  for (std::size_t at = 0; at < environment.size();) {
    const std::string entry = environment.c_str() + at;
    at += entry.size() + 1;
    const auto equals = entry.find('=');
    if (equals != std::string::npos && is_asked(entry.substr(0, equals)))
      found[entry.substr(0, equals)] = entry.substr(equals + 1);
  }
  return found;
}

ProcessFacts this_process() {
  ProcessFacts facts;
  facts.user = ::geteuid();
  facts.variables = variables_in(content_of("/proc/self/environ"));
  return facts;
}

// The facts of the program behind a socket; false: they cannot be known.
bool facts_of(const std::string& socket, ProcessFacts& facts) {
  const std::string folder = "/proc/" + std::to_string(process_of(socket));
  const std::string environment = content_of(folder + "/environ");
  struct stat owner {};
  if (environment.empty() || ::stat(folder.c_str(), &owner) != 0) return false;
  facts.user = owner.st_uid;
  facts.variables = variables_in(environment);
  return true;
}

// The cpu.stat of the group of a process, where groups are of version 2.
std::string cpu_stat_of(int process) {
  const std::string groups = content_of("/proc/" + std::to_string(process) + "/cgroup");
  if (!groups.starts_with("0::")) return {};
  const std::string group = groups.substr(3, groups.find('\n') - 3);
  return content_of("/sys/fs/cgroup" + group + "/cpu.stat");
}

// An update does not end what runs.
bool is_replaced(int process) {
  std::error_code failed;
  const auto file =
      std::filesystem::read_symlink("/proc/" + std::to_string(process) + "/exe", failed);
  return !failed && file.string().ends_with(" (deleted)");
}

MachineFacts this_machine() {
  MachineFacts facts;
  facts.congestion_controls = content_of("/proc/sys/net/ipv4/tcp_allowed_congestion_control");
  while (facts.congestion_controls.ends_with('\n')) facts.congestion_controls.pop_back();
  struct statvfs shared {};
  if (::statvfs("/dev/shm", &shared) == 0)
    facts.shared_memory_free_bytes =
        static_cast<std::uint64_t>(shared.f_bavail) * static_cast<std::uint64_t>(shared.f_frsize);
  return facts;
}

Found silent_program(const std::string& socket, const std::string& seen) {
  return {"program_silent", "process " + std::to_string(process_of(socket)), seen};
}

// Programs of this user that are here and say nothing.
std::vector<Found> silent_programs() {
  std::vector<Found> found;
  for (const std::string& socket : status_sockets())
    if (const Asked asked(socket, "/healthz"); !asked.problem().empty())
      found.push_back(silent_program(socket, asked.problem()));
  return found;
}

// The status of each program of this user that answers.
std::vector<Json> statuses() {
  std::vector<Json> all;
  for (const std::string& socket : status_sockets())
    if (Asked asked(socket, "/api/status"); asked.problem().empty())
      all.push_back(read_status(asked.rest()));
  return all;
}

// A client of this user has a link to this port.
bool is_linked(const Url& url) {
  const std::string end = ":" + std::to_string(url.port);
  for (const Json& status : statuses()) {
    if (text_in(status, "role") != "client") continue;
    for (const Json& link : part_of(status, "links"))
      if (is_set(link, "open") && text_in(link, "peer").ends_with(end)) return true;
  }
  return false;
}

// The client's own code tries the path, TLS and the login.
std::vector<Found> look_through_link(const Config& config, bool logs_in) {
  Assembly assembly = assemble(config, "/ctl_doctor");
  std::vector<Found> found;
  for (const Failure& problem : assembly.problems) found.push_back(diagnose(problem));
  if (!assembly.parts) return found;
  Probe::Options options;
  options.logs_in = logs_in;
  Probe probe(std::move(*assembly.parts), options);
  if (const Failure failure = probe.open(kPatienceOfDoctor)) {
    // The client that runs has the only place, so its path and login are right.
    if (failure.cause == Cause::kTooManyConnections && is_linked(config.dial.url)) return found;
    found.push_back(diagnose(failure));
    if (failure.cause == Cause::kServerSilent && syntax::is_loopback(config.dial.url.host))
      add_found(found, silent_programs());
    return found;
  }
  probe.close();
  if (!logs_in) found.push_back({"login_not_tried", {}, {}});
  return found;
}

// A server of this user listens at the port: the one that is asked about, as it seems.
bool is_ours(const Config& config) {
  const std::string end = ":" + std::to_string(config.listen.port);
  for (const Json& status : statuses())
    for (const Json& address : part_of(status, "listens"))
      if (address.is_string() && address.get<std::string>().ends_with(end)) return true;
  return false;
}

// A server that runs may listen at an address that this machine has lost, or never had.
void add_absent(std::vector<Found>& to, const std::vector<std::string>& addresses,
                const std::string& subject = {}) {
  for (const std::string& address : addresses)
    if (const Failure failure = why_not_reached(address))
      add_found(to, {diagnose(failure)}, subject);
}

// Something else listens where the status is to be: the program does not start. Beyond loopback the
// program itself may be there, which answers no plain question.
std::vector<Found> look_at_status_port(const StatusOptions& status) {
  if (status.address.empty() || !syntax::is_loopback(status.address)) return {};
  ListenOptions listen;
  listen.addresses = {status.address};
  listen.port = status.port;
  const Failure failure = why_not_listening(listen);
  const std::string where = host_and_port(status.address, status.port);
  if (!failure || Asked(where, "/healthz").problem().empty()) return {};
  return {diagnose(failure)};
}

std::vector<Found> look_at_file(const DoctorOrder& order) {
  const FileJudged judged = judge_file(order.what, order.role);
  std::vector<Found> found;
  for (const Failure& problem : judged.given.problems) {
    Found one = diagnose(problem);
    // A file may be for nodes with names of their own, of which this tool knows nothing.
    one.is_hint = problem.cause == Cause::kSectionMissing && order.role.empty();
    add_found(found, {std::move(one)}, order.what);
  }
  if (!judged.config) return found;
  for (const Failure& hint : judged.hints) add_found(found, {diagnose(hint)}, order.what);
  for (const Failure& warning : judged.warnings) {
    Found one = diagnose(warning);
    if (warning.cause == Cause::kOther) one.id = "start_warns";
    one.is_hint = true;  // the program starts
    add_found(found, {std::move(one)}, order.what);
  }
  add_found(found, diagnose_config(*judged.config), order.what);
  const Config& config = *judged.config;
  if (judged.given.role == Role::kServer && config.listen_address != "systemd") {
    if (is_ours(config)) {
      add_absent(found, config.listen.addresses, order.what);
    } else if (const Failure failure = why_not_listening(config.listen)) {
      add_found(found, {diagnose_port(failure, listener_at(config.listen.port), ::geteuid())},
                order.what);
    }
  }
  add_found(found, look_at_status_port(config.status), order.what);
  const bool dials =
      judged.given.role == Role::kClient && judged.given.problems.empty() && !order.offline;
  if (dials)
    add_found(found, look_through_link(*judged.config, true), judged.config->dial.url.text("ws"));
  return found;
}

std::vector<Found> look_at_url(const DoctorOrder& order, std::vector<std::string>& wrong) {
  ParameterMap parameters{{"url", order.what}};
  const Surroundings around = surroundings();
  const bool logs_in = !order.token_file.empty() || around.token_in_environment;
  parameters["auth.method"] = std::string(logs_in ? "token" : "none");
  if (!order.token_file.empty()) parameters["auth.token_file"] = order.token_file;
  if (!order.ca.empty()) parameters["tls.ca"] = order.ca;
  if (!order.pin.empty()) parameters["tls.pin"] = std::vector<std::string>{order.pin};
  const Parsed parsed = parse_config(parameters, Role::kClient, around);
  for (const auto& problem : parsed.problems) wrong.push_back(to_text(problem));
  std::vector<Found> found;
  if (parsed.config) add_found(found, look_through_link(*parsed.config, logs_in), order.what);
  return found;
}

// What a program says of itself, and what is wrong with it.
struct Looked {
  std::string role;     // empty: it does not answer
  std::string problem;  // then: why
  ProgramFacts facts;
  std::vector<Found> found;
};

// The token file of a server, relative to the folder of the program.
void look_at_tokens(const std::string& token_file, SideFacts& facts, std::vector<Found>& found) {
  TokenTable table;
  std::vector<std::string> problems, warnings;
  const std::string text = content_of(token_file);
  table.read(text, token_file, 0, problems, warnings);
  if (!problems.empty() && !text.empty())
    found.push_back({"file_refused", token_file, to_text(problems.front(), kSeenBytes), true});
  if (problems.empty())
    for (const auto& ended : table.ending(0, system_now()))
      facts.expired.push_back(to_text(ended.identity, kNameBytes));
}

// The program has read its files, and what became wrong with them since then shows here.
bool may_have_come_later(Cause cause) {
  return cause == Cause::kFileMissing || cause == Cause::kFileDistrusted ||
         cause == Cause::kFileReadable;
}

// Its parameters are those of its files, and of its command line, which is not read here.
std::vector<Found> look_at_files(const std::string& socket, const std::string& role,
                                 SideFacts& facts) {
  const Program program(socket);
  std::vector<Found> found;
  std::error_code failed;
  const auto here = std::filesystem::current_path(failed);
  if (!failed) std::filesystem::current_path(program.folder, failed);  // relative names begin there
  if (failed) return found;
  ParameterMap parameters;  // of the files together: the last one that names a key has it
  for (const std::string& file : program.parameter_files()) {
    if (!std::filesystem::is_regular_file(file, failed)) continue;  // a pipe may never end
    const FileJudged judged = judge_file(file, role);
    for (const std::vector<Failure>& all : {judged.given.problems, judged.hints})
      for (const Failure& failure : all)
        if (may_have_come_later(failure.cause)) add_found(found, {diagnose(failure)}, file);
    for (const auto& [key, value] : judged.given.parameters)
      parameters.insert_or_assign(key, value);
  }
  for (const Failure& problem : check_host(parameters).problems)
    if (problem.cause == Cause::kCertificateFiles)
      found.push_back({"file_refused", {}, to_text(problem.text, kSeenBytes), true});
  const Role of = role == "client" ? Role::kClient : Role::kServer;
  if (const Parsed parsed = parse_config(parameters, of, surroundings()); parsed.config) {
    const Config& config = *parsed.config;
    facts = facts_of(config);
    add_found(found, diagnose_config(config));
    if (config.role == Role::kServer && !config.auth.token_file.empty())
      look_at_tokens(config.auth.token_file, facts, found);
  }
  std::filesystem::current_path(here, failed);
  return found;
}

// "192.168.1.20" of "192.168.1.20:9090", "::" of "[::]:9090".
std::vector<std::string> hosts_of(const Json& listens) {
  std::vector<std::string> hosts;
  for (const Json& one : listens) {
    if (!one.is_string()) continue;
    const std::string host = host_of(one.get<std::string>());
    hosts.push_back(host.starts_with('[') ? host.substr(1, host.size() - 2) : host);
  }
  return hosts;
}

Looked look_at_side(const std::string& where) {
  Looked looked;
  Asked asked(where, "/api/status");
  looked.problem = asked.problem();
  if (!looked.problem.empty()) return looked;
  const Json status = read_status(asked.rest());
  looked.role = text_in(status, "role");
  if (looked.role.empty()) looked.role = "unknown";
  looked.facts.node = text_in(status, "node");
  looked.facts.process = process_of(where);
  ProcessFacts side;
  if (looked.role == "relay" || where.find('/') == std::string::npos || !facts_of(where, side)) {
    looked.found = diagnose_status(status);
    return looked;
  }
  looked.facts.domain =
      side.variables.contains("ROS_DOMAIN_ID") ? side.variables["ROS_DOMAIN_ID"] : "0";
  looked.facts.brings = brought_topics(status);
  SideFacts facts;
  std::vector<Found> of_files = look_at_files(where, looked.role, facts);
  looked.found = diagnose_status(status, facts);
  if (!carries_data(status)) add_found(looked.found, diagnose_processes(side, this_process()));
  const auto is_refused = [](const Found& one) { return one.id == "file_refused"; };
  if (std::any_of(looked.found.begin(), looked.found.end(), is_refused))
    std::erase_if(of_files, is_refused);  // the program has said it itself
  add_found(looked.found, std::move(of_files));
  add_found(looked.found, diagnose_throttling(cpu_stat_of(looked.facts.process)));
  if (is_replaced(looked.facts.process)) looked.found.push_back({"program_replaced", {}, {}});
  add_absent(looked.found, hosts_of(part_of(status, "listens")));
  return looked;
}

bool is_of_path(const Found& found) {
  return found.id == "path_loses" || found.id == "link_too_thin";
}

std::vector<Found> look_at_what_runs() {
  std::vector<Found> found;
  std::vector<ProgramFacts> programs;
  const auto sockets = status_sockets();
  for (const std::string& socket : sockets) {
    Looked looked = look_at_side(socket);
    const int process = process_of(socket);
    if (looked.role.empty()) looked.found.push_back(silent_program(socket, looked.problem));
    const std::string name = looked.facts.node.substr(looked.facts.node.starts_with('/') ? 1 : 0);
    if (sockets.size() > 1 && !name.empty())
      for (Found& one : looked.found)
        one.program = name + (process != 0 ? " (" + std::to_string(process) + ")" : "") +
                      (one.program.empty() ? "" : ", " + one.program);
    if (looked.role != "relay") programs.push_back(looked.facts);
    add_found(found, std::move(looked.found));
  }
  if (sockets.empty()) found.push_back({"nobody_runs", {}, where_sockets_are()});
  gather_domains(programs, found);
  add_found(found, diagnose_programs(programs));
  MachineFacts machine = this_machine();
  machine.loses = std::any_of(found.begin(), found.end(), is_of_path);
  add_found(found, diagnose_machine(machine));
  return found;
}

bool is_socket(const std::string& what) {
  struct stat facts {};
  return ::stat(what.c_str(), &facts) == 0 && S_ISSOCK(facts.st_mode);
}

int print_list() {
  std::puts("| finding | cause | what to do |\n| --- | --- | --- |");
  for (const Finding& finding : all_findings())
    std::printf("| `%s`%s | %s | %s |\n", std::string(finding.id).c_str(),
                finding.is_hint ? " (hint)" : "", std::string(finding.cause).c_str(),
                std::string(finding.cure).c_str());
  return 0;
}

// "robot:9090", of which there is no file.
bool looks_like_host(const std::string& what) {
  const std::size_t colon = what.rfind(':');
  return ::access(what.c_str(), F_OK) != 0 && colon != std::string::npos && colon > 0 &&
         colon + 1 < what.size() && what.find('/') == std::string::npos &&
         what.find_first_not_of("0123456789", colon + 1) == std::string::npos;
}

void look_at_shell(std::vector<Found>& found) {
  add_found(found, diagnose_shell(this_process()));
  if (const auto missing = ros::missing_middleware())
    found.insert(found.begin(), {"rmw_missing", {}, to_text(*missing)});
}

int run_doctor(const DoctorOrder& order) {
  if (order.list) return print_list();
  std::signal(SIGPIPE, SIG_IGN);
  std::vector<Found> found;
  const std::string& what = order.what;
  if (what.empty()) {
    found = look_at_what_runs();
  } else if (what.starts_with("ws://") || what.starts_with("wss://")) {
    std::vector<std::string> wrong;
    found = look_at_url(order, wrong);
    if (!wrong.empty()) return complain(what + ": " + wrong.front(), kExitConfiguration);
  } else if (is_socket(what) || syntax::parse_status_address(what)) {
    Looked looked = look_at_side(what);
    found = std::move(looked.found);
    if (looked.role.empty() && is_socket(what))
      found.push_back(silent_program(what, looked.problem));
    else if (looked.role.empty())
      return complain(what + ": nobody answers", kExitConfiguration);
  } else if (looks_like_host(what)) {
    return complain(what + ": no such file; did you mean wss://" + what + "?", kExitConfiguration);
  } else {
    found = look_at_file(order);
  }
  look_at_shell(found);
  std::fputs((order.json ? report_json(found) : report_text(found)).c_str(), stdout);
  return has_fault(found) ? kSomethingWrong : 0;
}

}  // namespace

std::string doctor_report() {
  std::vector<Found> found = look_at_what_runs();
  look_at_shell(found);
  return report_text(found);
}

void add_doctor_command(CLI::App& app, int& exit_code) {
  const auto order = std::make_shared<DoctorOrder>();
  auto* doctor = app.add_subcommand("doctor", "Say why it does not work: the cause and the cure");
  doctor->footer(
      "Exit code: 0 if nothing is wrong as far as it sees, 1 if something is, 2 if the question is "
      "wrong.");
  doctor->add_option("what", order->what,
                     "A parameter file (of a client also the link that it makes), a URL as "
                     "wss://robot:9090, an address of status.listen, or a socket. Without it: this "
                     "user's programs on this machine");
  doctor->add_option("--role", order->role, "For a file: server or client")
      ->check(CLI::IsMember({"server", "client"}));
  doctor->add_option("--token-file", order->token_file,
                     "For a URL: the file with the token. Without it, and without "
                     "CONNECT_BRIDGE_TOKEN, the way is tried and no login");
  doctor->add_option("--ca", order->ca, "For a URL: the authority of the server's certificate");
  doctor->add_option("--pin", order->pin, "For a URL: the pin of the server's key");
  doctor->add_flag("--offline", order->offline, "Of a client's file: do not dial");
  doctor->add_flag("--json", order->json, "As JSON");
  doctor->add_flag("--list", order->list, "Print all that it can find, as a table");
  doctor->callback([order, &exit_code] { exit_code = run_doctor(*order); });
}
