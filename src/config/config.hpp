// What the operator configured: parameters in, a Config out, or everything that is wrong with them.
// Pure: whether a file can be read and whether a token is in the environment are arguments.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "config/parameter.hpp"
#include "core/policy/policy.hpp"
#include "core/side/side.hpp"

namespace connect_bridge {

// The value of an environment variable; empty: it is not set.
using Variable = std::function<std::string(const char* name)>;

struct ListenConfig {  // server
  // IP addresses (IPv6 without brackets) with commas, "*" for every one, or "systemd".
  std::string address;
  std::uint16_t port = 9090;                 // 0: any free one
  std::string path;                          // begins with '/'
  std::vector<std::string> trusted_proxies;  // addresses and ranges of them
  std::string proxy_header;                  // x_forwarded_for, forwarded, proxy_protocol
  bool proxies_only = false;                 // there is no TLS for others
  std::uint32_t address_strangers_max = 16;  // connections of an address without a login
  int handshakes_per_second = 50;            // TLS
  int address_handshakes_per_second = 10;
};

struct HttpProxyConfig {
  std::string host;  // name or IP address; IPv6 without brackets
  std::uint16_t port = 0;
  std::string login;                           // "user:password", secret; empty: none
  std::string login_key = "http_proxy_login";  // or the variable of the environment
};

struct DialConfig {  // client
  std::string url;   // as given
  bool tls = false;  // wss
  std::string host;  // name or IP address; IPv6 without brackets
  std::uint16_t port = 0;
  std::string target;                    // path and query; begins with '/'
  std::optional<HttpProxyConfig> proxy;  // the way there, by CONNECT
};

// Files are PEM. Server: with a certificate it speaks TLS only, with `ca` clients must show a
// certificate, too.
struct TlsConfig {
  std::string certificate, private_key;  // both or none
  std::string ca;           // authorities to trust; empty: the system's (client), none (server)
  std::string server_name;  // client: name to verify; empty: the URL's host
  std::vector<std::string> pins;  // client: SHA-256 of public keys in base64; empty: any key
};

// Where the token (a client's credential) comes from, strongest first: `token`, `token_file`, the
// environment variable. The others are a server's, each of one method.
struct AuthConfig {
  std::string method = "token";  // or "certificate", "jwt", "service", "plugin", "none"
  std::string token;             // secret; empty: not given
  std::string token_file;
  std::string jwt_keys, jwt_issuer, jwt_audience, jwt_groups_claim;
  std::vector<std::string> jwt_algorithms;
  std::string service, https_ca;
  std::optional<HttpProxyConfig> https_proxy;  // on the way to the address of the two above
  std::string plugin, plugin_options;          // the options may hold a secret
};

struct SocketConfig {
  std::uint32_t not_sent_bytes = 16384;      // TCP_NOTSENT_LOWAT; 0: leave it to the host
  std::int64_t packets_per_second = 50'000;  // read from a peer; 0: no limit
  std::int64_t bytes_per_second = 0;         // likewise
  // TCP_CONGESTION: "auto" (what suits the path), "host" (leave it), or an algorithm.
  std::string congestion_control;
};

struct AuditConfig {
  std::string file;  // empty: there is no audit log
  std::uint64_t file_bytes_max = 10 << 20;
  std::uint32_t files_kept = 10;
};

// Immutable once made; a change is a new Config.
struct Config {
  Role role = Role::kServer;
  ListenConfig listen;
  DialConfig dial;
  TlsConfig tls;
  AuthConfig auth;
  SocketConfig socket;
  Policy policy;
  NameMap names;
  std::string prefix;
  std::vector<NameMap::Pair> remap;
  std::string status_file;  // empty: none is written
  std::string usage_file;   // likewise
  AuditConfig audit;
  bool carries_types_not_installed = true;
  bool default_rules = false;  // a client without rules: see default_rule()
  Duration clock_publish_period = Duration::zero();
  SideOptions limits;  // dead_after, retry, depths, outbox, reassembly ...; see side_options()
  bool token_in_environment = false;  // as it was at start
  std::vector<std::string> warnings;  // sentences to log at start
  ParameterMap given;                 // what it was made from; contains the token, never print it
};

// What a configuration is checked against besides itself: values of the host.
struct Surroundings {
  bool token_in_environment = false;
  Variable variable{};                                     // empty: none is set
  std::function<bool(const std::string& file)> readable;   // empty: not checked
  std::function<bool(const std::string& type)> installed;  // a message type; empty: not checked
};

struct Parsed {
  std::optional<Config> config;   // present exactly if there are no problems
  std::vector<Problem> problems;  // all of them
};

[[nodiscard]] Parsed parse_config(const ParameterMap& parameters, Role role,
                                  const Surroundings& surroundings);

// A change at run time (the token in the environment counts as at start: a program may have
// scrubbed it). All or nothing; only changeable keys. Apply the result
// by giving PolicyChanged{config->policy} to the Side: nothing else of it differs. Less strict than
// at start in one point, so that rules can be changed one parameter at a time: a rule that is
// defined and not listed in `rules` is a warning.
[[nodiscard]] Parsed apply_change(const Config& current, const std::vector<Parameter>& changes,
                                  const Surroundings& surroundings);

// The caller adds the rest: `node`, and `credential` when the token is in a file or in the
// environment (here it is filled from auth.token only).
[[nodiscard]] SideOptions side_options(const Config& config);

}  // namespace connect_bridge
