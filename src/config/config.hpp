// What the operator configured: parameters in, a Config out, or everything that is wrong with them.
// Pure: whether a file can be read and whether a token is in the environment are arguments.
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

// Immutable once made; a change is a new Config.
struct Config {
  Role role = Role::kServer;
  Role robot = Role::kServer;  // which end that is
  // Server: IP addresses (IPv6 without brackets) with commas, "*" for every one, or "systemd".
  std::string listen_address;
  ListenOptions listen;  // without TLS, and the relay's token
  std::vector<std::string> relay_pins;
  std::string relay_token_file;
  DialOptions dial;  // client; without TLS
  // Server: with a certificate it speaks TLS only.
  TlsOptions tls;
  // Where the token (a client's credential) comes from, strongest first: `token`, `token_file`, the
  // environment variable.
  LoginOptions auth;
  SocketOptions socket;
  Policy policy;
  PeerNames names;
  std::string prefix;  // or kByIdentity
  PeerNames::Words identity_names;
  std::vector<NameMap::Pair> remap;
  bool reached_by_others = false;     // by other machines, or through a proxy
  std::optional<LogLevel> log_level;  // none: as the arguments say
  std::string status_file;            // empty: none is written
  StatusOptions status;
  AuditOptions audit;
  bool carries_types_not_installed = true;
  bool default_rules = false;  // see default_rule()
  Duration clock_publish_period = Duration::zero();
  std::vector<std::string> clock_identities, clock_groups;  // whose time
  SideOptions limits;  // dead_after, retry, depths, outbox, reassembly ...; see side_options()
  bool token_in_environment = false;  // as it was at start
  std::vector<std::string> warnings;  // sentences to log at start
  ParameterMap given;                 // what it was made from; contains the token, never print it

  [[nodiscard]] bool is_robot() const { return role == robot; }
};

// What a configuration is checked against besides itself: values of the host.
struct Surroundings {
  bool token_in_environment = false;
  Variable variable{};  // empty: none is set
  // Why a file cannot be read, or nothing. Without the function files are not checked.
  std::function<Failure(const std::string& file)> unreadable;
  // Why somebody else may change a file, for people, or empty. The same.
  std::function<std::string(const std::string& file)> distrusted;
  std::function<bool(const std::string& type)> installed;  // a message type; empty: not checked
};

struct Parsed {
  std::optional<Config> config;   // present exactly if there are no problems
  std::vector<Problem> problems;  // all of them
};

// Less strict while the program runs, in one point, so that rules can be changed one parameter at a
// time: a rule that is defined and not listed in `rules` is a warning.
enum class ReadAt : std::uint8_t { kStart, kRunning };

[[nodiscard]] Parsed parse_config(const ParameterMap& parameters, Role role,
                                  const Surroundings& surroundings, ReadAt moment = ReadAt::kStart);

// A change at run time (the token in the environment counts as at start: a program may have
// scrubbed it): the whole configuration that it makes is judged, and taken or refused. Only keys
// that are `changeable` differ in it (key_table.hpp); LiveParameters tells its owner, who applies
// them.
[[nodiscard]] Parsed apply_change(const Config& current, const std::vector<Parameter>& changes,
                                  const Surroundings& surroundings);

// The caller adds the rest: `node`, and `credential` when the token is in a file or in the
// environment (here it is filled from auth.token only).
[[nodiscard]] SideOptions side_options(const Config& config);

}  // namespace connect_bridge
