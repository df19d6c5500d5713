// The operator's configuration: parameters in; a Config, or all problems with them, out. Pure:
// arguments say whether a file can be read and whether the environment has a token.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "config/parameter.hpp"
#include "core/policy/policy.hpp"
#include "core/ports/audit.hpp"
#include "core/ports/login_options.hpp"
#include "core/ports/net_options.hpp"
#include "core/side/options.hpp"

namespace connect_bridge {

// The value of an environment variable; empty: it is not set.
using Variable = std::function<std::string(const char* name)>;

// A Config is immutable once made; a change makes a new Config.
struct Config {
  Role role = Role::kServer;
  Role robot = Role::kServer;  // the end that is the robot
  // Server: IP addresses (IPv6 without brackets) separated by commas, "*" for every address, or
  // "systemd".
  std::string listen_address;
  ListenOptions listen;  // the server's TLS and the relay's token are not filled in
  std::vector<std::string> relay_pins;
  std::string relay_token_file;
  DialOptions dial;  // client; TLS is not filled in
  // A server with a certificate accepts TLS only.
  TlsOptions tls;
  // Sources of the token (a client's credential), strongest first: `token`, `token_file`, the
  // environment variable.
  LoginOptions auth;
  SocketOptions socket;
  Policy policy;
  PeerNames names;
  std::string prefix;  // or kByIdentity
  PeerNames::Words identity_names;
  std::vector<NameMap::Pair> remap;
  bool reached_by_others = false;     // beyond this machine, or by a proxy or relay
  std::optional<LogLevel> log_level;  // none: the level of the arguments
  std::string status_file;            // empty: none is written
  StatusOptions status;
  AuditOptions audit;
  bool carries_types_not_installed = true;
  bool default_rules = false;  // see default_rule()
  Duration clock_publish_period = Duration::zero();
  std::vector<std::string> clock_identities, clock_groups;  // peers whose time is published
  SideOptions limits;  // dead_after, retry, depths, outbox, reassembly ...; see side_options()
  double picture_cpu = 0.5;           // Workers::Options::cores, for pictures
  bool token_in_environment = false;  // the state at start
  std::vector<std::string> warnings;  // sentences to log at start
  ParameterMap given;                 // its parameters; contains the token, never print it

  [[nodiscard]] bool is_robot() const { return role == robot; }
};

// Values of the host that a configuration is checked against.
struct Surroundings {
  bool token_in_environment = false;
  Variable variable{};  // empty: none is set
  // Why a file cannot be read, or nothing. Without the function files are not checked.
  std::function<Failure(const std::string& file)> unreadable;
  // Why somebody else may change a file, for people, or empty. The same.
  std::function<std::string(const std::string& file)> distrusted;
  std::function<bool(const std::string& type)> installed;  // for a message type; empty: not checked
  std::uint64_t memory_bytes = 0;  // of this machine, or of what limits this process; 0: not known
};

// The result of parsing: a Config, or all problems.
struct Parsed {
  std::optional<Config> config;   // present exactly if there are no problems
  std::vector<Problem> problems;  // all of them
};

// kRunning is less strict in one point, so that rules can be changed one parameter at a time: a
// rule that is defined but not listed in `rules` is a warning.
enum class ReadAt : std::uint8_t { kStart, kRunning };

// Checks the parameters of one program and makes its Config. Reports all problems, not only the
// first. Any thread.
[[nodiscard]] Parsed parse_config(const ParameterMap& parameters, Role role,
                                  const Surroundings& surroundings, ReadAt moment = ReadAt::kStart);

// Applies a change at run time and checks the resulting configuration as a whole: the result is a
// Config, or all problems. Only `changeable` keys may differ (key_table.hpp). The token in the
// environment counts as at start, since a program may have scrubbed it. LiveParameters reports the
// new Config to its owner, who applies it.
[[nodiscard]] Parsed apply_change(const Config& current, const std::vector<Parameter>& changes,
                                  const Surroundings& surroundings);

// Options of the core. The caller adds `node`, and `credential` if the token is in a file or in the
// environment: here only auth.token fills it.
[[nodiscard]] SideOptions side_options(const Config& config);

}  // namespace connect_bridge
