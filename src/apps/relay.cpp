// Joins robots and operators that cannot connect directly, on a machine that both can reach. Runs
// without ROS.
#include <fmt/chrono.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "access/login/file_trust.hpp"
#include "access/login/token_table.hpp"
#include "config/document.hpp"
#include "config/key_search.hpp"
#include "config/syntax.hpp"
#include "net/tcp/descriptors.hpp"
#include "net/tcp/system_now.hpp"
#include "net/tls/certificate_end.hpp"
#include "net/tls/tls.hpp"
#include "relay/relay.hpp"
#include "relay/relay_file.hpp"
#include "relay/relay_site.hpp"
#include "relay/robot_line.hpp"

namespace connect_bridge {
namespace {

constexpr int kExitWrong = 2;

int refuse(const std::vector<std::string>& problems) {
  for (const auto& problem : problems) std::fprintf(stderr, "relay: %s\n", problem.c_str());
  return kExitWrong;
}

void log_line(LogLevel level, const std::string& text) {
  constexpr const char* kNames[] = {"DEBUG", "INFO", "WARN", "ERROR"};
  if (level == LogLevel::kDebug) return;
  const std::string time = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  std::fprintf(stderr, "[%s] [%s] %s\n", kNames[static_cast<int>(level)], time.c_str(),
               text.c_str());
}

Failure why_not_readable(const std::string& file) {
  return std::ifstream(file) ? Failure{} : Failure{Cause::kFileUnreadable, "it cannot be opened"};
}

// Calls `tick` once a second.
void each_second(boost::asio::steady_timer& timer, const std::function<void()>& tick) {
  timer.expires_after(std::chrono::seconds(1));
  timer.async_wait([&timer, tick](const boost::system::error_code& ended) {
    if (ended) return;
    tick();
    each_second(timer, tick);
  });
}

int run(RelaySetup setup, const StatusOptions& status_at) {
  const std::string started = date_text(system_now());
  boost::asio::io_context io(1);
  const auto relay = std::make_shared<Relay>(io, std::move(setup), &log_line);
  const auto status = [&] {
    RelayStatus now = relay->status();
    now.time = date_text(system_now());
    now.started = started;
    now.version = version_text();
    return now;
  };
  RelaySite site(io, status, &log_line);
  std::string problem = relay->open();
  if (problem.empty()) problem = site.open(status_at);
  if (!problem.empty()) return refuse({problem});
  log_line(LogLevel::kInfo, "the relay listens on port " + std::to_string(relay->port()));
  if (site.port() != 0)
    log_line(LogLevel::kInfo, "the status is at http://" +
                                  host_and_port(status_at.address, site.port()) + "/api/status");
  boost::asio::steady_timer seconds(io);
  each_second(seconds, [&] {
    relay->every_second();
    site.tell();
  });
  boost::asio::signal_set stop(io, SIGINT, SIGTERM);
  stop.async_wait([&](const boost::system::error_code&, int) {
    relay->close();
    io.stop();
  });
  io.run();
  return 0;
}

// A relay starts with a certificate that has ended, and robots refuse it.
int check_end(asio::ssl::context& own) {
  CertificateEnd end = end_of_certificate(own);
  Now now;
  now.system = system_now();
  const auto line = end.take_line(now);
  if (line && end.is_over(now.system)) return refuse({"tls.certificate: " + *line});
  if (line) log_line(LogLevel::kWarn, *line);
  return 0;
}

// `is_own`: it is the relay's own file.
int start(const std::string& name, bool is_own, bool only_checks) {
  std::ifstream file(name);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf()))
    return refuse({is_own && !std::filesystem::exists(name)
                       ? "no relay is set up here yet: 'relay --robot NAME@HOST:443' makes " +
                             name +
                             ", and prints the registration command of the first robot. HOST is "
                             "this machine's name or address, as robots and clients reach it"
                       : name + " cannot be read"});
  Surroundings around;
  around.unreadable = &why_not_readable;
  around.distrusted = &who_else_may_change;
  const RelayFile read = read_relay_file(text.str(), around);
  if (!read.config) return refuse(read.problems);
  const std::string others = read.config->auth.strict_modes ? who_else_may_have_changed(name) : "";
  if (!others.empty()) return refuse({"this file decides which robots may connect: " + others});
  const AuthOptions login{read.config->auth, std::nullopt, kLineGroup};
  AuthSetup robots = make_authenticator(login, system_now());
  if (!robots.authenticator) return refuse(robots.problems);
  std::string problem;
  TlsOptions tls = read.config->tls;
  tls.distrusted = read.config->auth.strict_modes ? &who_else_may_change : nullptr;
  const TlsContext own = make_server_tls(tls, problem);
  if (!own) return refuse({problem});
  for (const auto& warning : robots.warnings) log_line(LogLevel::kWarn, warning);
  if (only_checks) return check_end(*own);
  RelaySetup setup;
  setup.addresses = read.config->listen.addresses;
  setup.port = read.config->listen.port;
  setup.tls = tls;
  for (const std::string& range : read.config->listen.trusted_proxies)
    if (const auto parsed = AddressRange::parse(range)) setup.proxies.push_back(*parsed);
  const auto give = [login](const RobotNames::Taking& of, std::string& wrong) {
    AuthSetup next;
    wrong = hand_over(login.token_file, of.robot, of.token, of.code, system_now());
    if (wrong.empty()) next = make_authenticator(login, system_now());
    if (!next.problems.empty()) wrong = next.problems.front();
    return std::move(next.authenticator);
  };
  setup.names = RobotNames(std::move(robots.authenticator), give);
  return run(std::move(setup), read.config->status);
}

// `file`: empty means the relay's own file, which is created if it is missing.
int print_robot_line(const std::string& file, const std::string& robot) {
  const auto url = syntax::parse_url("wss://" + robot + "/");
  if (!url || url->robot.empty())
    return refuse(
        {"--robot: expected the robot's name (a to z, 0 to 9 and -) and this relay's "
         "address, as in robot7@relay.example:443"});
  const std::string folder =
      file.empty() ? relay_folder() : std::filesystem::absolute(file).parent_path().string();
  std::string problem = file.empty() ? make_relay_files(folder, *url) : "";
  std::string line;
  if (problem.empty())
    line = add_robot(file.empty() ? folder + "/relay.yaml" : file, *url, system_now(), problem);
  if (problem.empty())
    line = line_to_print(url->robot, line, ::isatty(STDOUT_FILENO) == 1, folder, problem);
  if (!problem.empty()) return refuse({problem});
  std::fputs(line.c_str(), stdout);
  return 0;
}

}  // namespace
}  // namespace connect_bridge

int main(int argc, char** argv) {
  CLI::App app{
      "relay: joins robots (server with listen.relay.url) and operators (client with a url like "
      "wss://robot7@relay.example/), on a machine that both can connect to. It sees who, when and "
      "how "
      "much, and none of the content. Manual: docs/reach.md"};
  app.set_version_flag("--version", connect_bridge::version_text(), "Print the version");
  std::string file;
  bool only_checks = false;
  std::string robot;
  app.add_option("file", file,
                 "The configuration, a small YAML file; without it that in ~/.connect_relay");
  app.add_option(
      "--robot", robot,
      "Add a robot, with the address of this relay, as robot7@relay.example:443, and print "
      "its registration command, with which its server is started");
  app.add_flag("--check", only_checks, "Only say what is wrong with the file");
  app.failure_message([](const CLI::App* failed, const CLI::Error& wrong) {
    const auto unknown = failed->remaining();
    const std::string meant =
        unknown.empty() ? ""
                        : connect_bridge::nearest_of({"--robot", "--check", "--help", "--version"},
                                                     unknown.front());
    if (!meant.empty()) return unknown.front() + " is unknown: did you mean " + meant + "?\n";
    return wrong.what() + ("\n" + std::string("--help lists the options\n"));
  });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& wrong) {
    return app.exit(wrong) == 0 ? 0 : connect_bridge::kExitWrong;
  }
  std::signal(SIGPIPE, SIG_IGN);
  connect_bridge::raise_descriptors();  // two for each pair
  try {
    if (!robot.empty()) return connect_bridge::print_robot_line(file, robot);
    const bool is_own = file.empty();
    if (is_own) file = connect_bridge::relay_folder() + "/relay.yaml";
    return connect_bridge::start(file, is_own, only_checks);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "relay: %s\n", error.what());
    return connect_bridge::kExitWrong;
  }
}
