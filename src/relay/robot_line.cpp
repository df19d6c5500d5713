#include "relay/robot_line.hpp"

#include <pwd.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "access/login/secret.hpp"
#include "access/login/token_file.hpp"
#include "access/login/token_table.hpp"
#include "config/invitation.hpp"
#include "core/base/bytes.hpp"
#include "core/base/sha256.hpp"
#include "net/tls/authority.hpp"
#include "relay/relay_file.hpp"
#include "relay/robot_names.hpp"

namespace connect_bridge {
namespace {

constexpr Stamp kLineLife = 24 * 3600 * kStampSecond;

bool is_there(const std::string& file) {
  return ::access(file.c_str(), F_OK) == 0;
}

}  // namespace

std::string relay_folder() {
  const char* const home = std::getenv("HOME");
  const bool given = home != nullptr && *home != '\0';
  const passwd* const user = given ? nullptr : ::getpwuid(::geteuid());
  return std::string{given ? home : user != nullptr ? user->pw_dir : "."} + "/.connect_relay";
}

std::string line_to_print(const std::string& robot, const std::string& line, bool terminal,
                          const std::string& folder, std::string& problem) {
  const std::string text =
      "\nTo register " + robot +
      " here, run this on the robot within 24 hours. It works once, and " +
      "the name then belongs to that robot:\n\n  ros2 run connect_bridge server --pair --via '" +
      line + "'\n\n";
  return secret_to_print(text, "The registration command of " + robot, terminal,
                         folder + "/" + robot + ".line", problem);
}

std::string make_relay_files(const std::string& folder, const Url& url) {
  std::string problem;
  if (!is_there(folder + "/server.crt")) problem = make_pinned_certificate(folder, url.host);
  const std::string robots = folder + "/robots.yaml";
  if (problem.empty() && !is_there(robots))
    problem = write_secret_file(robots, "# The robots of this relay.\n");
  const std::string file = folder + "/relay.yaml";
  if (problem.empty() && !is_there(file))
    problem = write_secret_file(
        file, "listen: {address: \"*\", port: " + std::to_string(url.port) + "}\n" +
                  "tls: {certificate: \"" + folder + "/server.crt\", private_key: \"" + folder +
                  "/server.key\"}\nauth: {token_file: \"" + robots + "\"}\n");
  return problem;
}

std::string add_robot(const std::string& relay_file, const Url& url, Stamp now,
                      std::string& problem) {
  std::ifstream file(relay_file);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) problem = relay_file + " cannot be read";
  const RelayFile read = problem.empty() ? read_relay_file(text.str(), {}) : RelayFile{};
  if (!read.problems.empty()) problem = relay_file + ": " + read.problems.front();
  if (!read.config) return {};
  Invitation line;
  line.url = "wss://" + url.robot + "@" + host_and_port(url.host, url.port) + "/";
  line.code = random_token();
  if (line.code.empty()) problem = "no random numbers are available";
  if (problem.empty()) line.pin = pin_of_file(read.config->tls.certificate_file, problem);
  TokenEntry entry;
  entry.identity = url.robot;
  entry.groups = {kLineGroup};
  entry.expires = date_text(now + kLineLife);
  entry.comment = "the code of a registration command, works once";
  entry.digest = sha256(view_of(line.code));
  if (problem.empty()) problem = append_token_entry(read.config->auth.token_file, entry);
  return problem.empty() ? to_relay_line(line) : std::string{};
}

std::string hand_over(const std::string& token_file, const std::string& robot, const Digest& token,
                      const Digest& code, Stamp now) {
  TokenEntry entry;
  entry.identity = robot;
  entry.comment = "by its registration command, " + date_text(now);
  entry.digest = token;
  return replace_token_entries(token_file, entry, code);
}

}  // namespace connect_bridge
