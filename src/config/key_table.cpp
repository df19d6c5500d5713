#include "config/key_table.hpp"

#include "config/http_proxy.hpp"
#include "config/key_rows.hpp"
#include "config/rule_rows.hpp"

namespace connect_bridge {
namespace {

using namespace syntax;  // NOLINT: a table reads better without the repeated word

void add_listen(Rows& rows) {
  const auto add = row_adder(rows, "Who is reached where", UsedBy::kServer);
  add({.key = "listen.address",
       .fallback = "127.0.0.1",
       .syntax = check_listen_address,
       .help = "IP address to listen on, or several separated by commas. `*`: all addresses. "
               "`systemd`: the sockets that systemd passes."},
      [](Config& c) { return &c.listen_address; });
  add("listen.port", {0, 65535}, "", "TCP port to listen on; 0 takes a free one and logs it.",
      [](Config& c) { return &c.listen.port; });
  add({.key = "listen.trusted_proxies",
       .syntax = check_address_range,
       .help = "Addresses, or ranges such as 10.0.0.0/8, of reverse proxies that may report the "
               "client's address."},
      [](Config& c) { return &c.listen.trusted_proxies; });
  add({.key = "listen.proxy_header",
       .fallback = "x_forwarded_for",
       .help = "How these proxies report it: in the header X-Forwarded-For, or by the PROXY "
               "protocol (1 or 2), with which each of their connections must then begin."},
      [](Config& c) { return &c.listen.named_by; });
  add({.key = "listen.relay.url",
       .syntax = check_relay_url,
       .help = "Relay through which clients reach this server too, with this robot's name: "
               "wss://robot7@relay.example/."});
  add({.key = "listen.relay.token_file",
       .syntax = check_not_empty,
       .help = "File with the token that identifies this robot at the relay."});
  add({.key = "listen.relay.ca",
       .syntax = check_not_empty,
       .help =
           "File with the certificates to trust for the relay (PEM). Unset: those of the system."});
  add({.key = "listen.relay.pin", .syntax = check_pin, .help = "As `tls.pin`, for the relay."},
      [](Config& c) { return &c.relay_pins; });
}

void add_dial(Rows& rows) {
  const auto add = row_adder(rows, "Who is reached where", UsedBy::kClient);
  add({.key = "url",
       .syntax = check_url,
       .help = "The server to connect to, wss:// or ws://; through a relay "
               "wss://robot7@relay.example/; on one cable wss://[fe80::1%eth0]/. Required."});
  add({.key = "http_proxy",
       .fallback = "environment",
       .syntax = check_http_proxy,
       .help = "HTTP proxy to connect through, http://proxy.example:3128. `environment`: the proxy "
               "in https_proxy. `none`: no proxy."});
  add({.key = "http_proxy_login",
       .syntax = check_http_proxy_login,
       .secret = true,
       .help = "\"user:password\" for that proxy, sent unencrypted."});
  row_adder(rows, "Who is reached where")(
      {.key = "allow_plaintext",
       .fallback = false,
       .help = "Permits ws:// beyond loopback. Everybody on the path can then read and change "
               "everything, the token included."});
}

void add_robot(Rows& rows) {
  row_adder(rows, "Who is reached where")(
      {.key = "robot",
       .fallback = "server",
       .help = "Which of the two ends is the robot; set the same word at both. Messages sent "
               "towards the robot before a break are not delivered after it. If the other end has "
               "no rules, it imports everything the robot's rules allow and exports topics only."},
      [](Config& c) { return &c.robot; });
}

void add_login(Rows& rows) {
  const auto add = row_adder(rows, "Login");
  add({.key = "auth.method",
       .fallback = "token",
       .words = {"token", "jwt", "service", "plugin", "certificate", "none"},
       .help = "How a client proves its identity; the same at both sides."},
      [](Config& c) { return &c.auth.method; });
  add({.key = "auth.token",
       .syntax = check_token,
       .secret = true,
       .help = "The token itself. A file, or the environment variable `CONNECT_BRIDGE_TOKEN`, "
               "keeps it out of parameter files."},
      [](Config& c) { return &c.auth.token; });
  add({.key = "auth.token_file",
       .syntax = check_not_empty,
       .help = "File with the token (client), or with one token or the hashes of many (server)."},
      [](Config& c) { return &c.auth.token_file; });
}

// Keys of one login method of a server. Keys without a field go to the method's library.
void add_login_methods(Rows& rows) {
  const auto add = row_adder(rows, "Login", UsedBy::kServer);
  add({.key = "auth.jwt_keys",
       .syntax = check_file_or_http_url,
       .help = "`jwt`: the keys that sign tokens: a file (JWKS, or public keys in PEM), or the "
               "https:// address of a JWKS."});
  add({.key = "auth.jwt_issuer", .syntax = check_not_empty, .help = "Required value of `iss`."});
  add({.key = "auth.jwt_audience",
       .syntax = check_not_empty,
       .help = "Required value of `aud`, or one of its values."});
  add({.key = "auth.jwt_groups_claim",
       .fallback = "groups",
       .syntax = check_not_empty,
       .help = "The claim that names the groups."});
  add({.key = "auth.service",
       .syntax = check_http_url,
       .help = "`service`: the https:// address that judges each login."});
  add({.key = "auth.https_ca",
       .syntax = check_not_empty,
       .help = "File with the authorities to trust for `auth.jwt_keys` and `auth.service` (PEM). "
               "Unset: those of the system."});
  add({.key = "auth.plugin",
       .syntax = check_not_empty,
       .help = "`plugin`: the shared library that judges logins. It runs inside the server."},
      [](Config& c) { return &c.auth.plugin; });
  add({.key = "auth.plugin_options",
       .secret = true,
       .help = "Options that the library receives at its start."});
}

void add_files(Rows& rows) {
  row_adder(rows, "Login")(
      {.key = "strict_modes",
       .fallback = true,
       .help = "Whether files that decide on rights (token, keys, authorities, plugin, parameter "
               "file) must be safe from other users. The files and all folders above them then "
               "belong to root or to the user of this program, and nobody else may write them."},
      [](Config& c) { return &c.auth.strict_modes; });
}

void add_tls(Rows& rows) {
  const auto add = row_adder(rows, "TLS");
  add({.key = "tls.certificate",
       .syntax = check_not_empty,
       .help = "File with this side's certificate chain (PEM). A server that has one accepts TLS "
               "only. A client presents it to servers that ask."},
      [](Config& c) { return &c.tls.certificate_file; });
  add({.key = "tls.private_key",
       .syntax = check_not_empty,
       .help = "File with the private key of the certificate (PEM)."},
      [](Config& c) { return &c.tls.private_key_file; });
  add({.key = "tls.ca",
       .syntax = check_not_empty,
       .help = "File with the certificates to trust (PEM). Client: they replace those of the "
               "system. Server: every client must present a certificate that they signed."},
      [](Config& c) { return &c.tls.ca_file; });
  add({.key = "tls.pin",
       .syntax = check_named_pin,
       .used_by = UsedBy::kClient,
       .help = "SHA-256 of the public keys that the server may have, in base64. Without tls.ca the "
               "key alone decides: the certificate may be self-signed, expired or for another "
               "name. A key may be followed by the identity and groups that rules use for this "
               "server: \"KEY NAME GROUP ...\"."},
      [](Config& c) { return &c.tls.pins; });
}

void add_names(Rows& rows) {
  const auto add = row_adder(rows, "Names at this side");
  add({.key = "prefix",
       .fallback = "",
       .syntax = check_prefix,
       .help = "Put before every name of the peer: /scan becomes /robot1/scan. Only local names "
               "below the prefix can be exported. Rules and the peer see all names without it. "
               "/parameter_events alone stays where it is, and its events name the nodes with the "
               "prefix. "
               "`by_identity`, at a server: the prefix of each client is its identity."},
      [](Config& c) { return &c.prefix; });
  add({.key = "identity_names",
       .fallback = Strings{},
       .syntax = check_identity_name,
       .used_by = UsedBy::kServer,
       .help = "With prefix: by_identity, maps identities that are not valid ROS names (`robot-7`) "
               "to names that are: \"robot-7:=robot7\". An identity that is neither valid nor "
               "mapped is refused."});
  add({.key = "remap",
       .fallback = Strings{},
       .syntax = check_remap,
       .help =
           "Single names that differ, each \"wire:=local\". They take precedence over prefix."});
  add({.key = "graph",
       .words = {"merged", "nodes"},
       .help = "Which node owns the imported interfaces. `merged`: this node. `nodes`: one node "
               "for each node of the peer that publishes or serves something here, with its name, "
               "so that `ros2 node`, `ros2 param` and `ros2 lifecycle` find it. Unset: `merged` at "
               "the robot, `nodes` at the other end."});
}

void add_operation(Rows& rows) {
  const auto add = row_adder(rows, "Operation");
  add({.key = "log_level",
       .changeable = true,
       .help = "Lowest level that is logged. Unset: the level of --log-level."},
      [](Config& c) { return &c.log_level; });
  add({.key = "status_file",
       .syntax = check_not_empty,
       .help = "File in which this side writes its status as JSON, once a second (docs/status.md). "
               "Use a folder in memory, below /run."},
      [](Config& c) { return &c.status_file; });
  add({.key = "status.listen",
       .syntax = check_status_address,
       .help = "Address of the status by HTTP, such as 127.0.0.1:9091 (docs/status.md); every user "
               "of this machine can then read it. Beyond loopback a server needs tls.certificate, "
               "auth.token_file and status.groups. Unset: only `ctl status` of this user."});
  add({.key = "status.groups",
       .used_by = UsedBy::kServer,
       .help = "Groups whose tokens may request the status beyond loopback."},
      [](Config& c) { return &c.status.groups; });
  add({.key = "types_not_installed",
       .fallback = "carry",
       .words = {"carry", "refuse"},
       .help =
           "Interfaces whose type's package is not installed here. `carry`: the bridge forwards "
           "them and does not check their content. `refuse`: only checked messages reach a node."});
}

void add_audit(Rows& rows) {
  const auto add = row_adder(rows, "Audit log");
  add({.key = "audit.file",
       .syntax = check_not_empty,
       .help = "File to which this side writes a line of JSON for each login, refusal, lost link, "
               "channel, call, goal and change of rules (docs/security.md)."},
      [](Config& c) { return &c.audit.file; });
  add({.key = "audit.required",
       .help = "Refuses a peer's call, goal or change of parameters that cannot be recorded now."},
      [](Config& c) { return &c.audit.required; });
}

void add_connection(Rows& rows) {
  const auto add = row_adder(rows, "Connection");
  add("dead_after", {0.2, 300}, "s",
      "A peer that was silent for this time counts as gone. An idle link costs some 45 MB a day at "
      "3 "
      "s, 5 MB at 30 s.",
      [](Config& c) { return &c.limits.dead_after; });
  add({.key = "resume.seconds",
       .fallback = 60.0,
       .range = NumberRange{0, 3600},
       .changeable = true,
       .unit = "s",
       .help = "How long this side stores messages of reliable topics for the peer's return after "
               "a loss (see \"After a break\"). 0: not at all."},
      [](Config& c) { return &c.limits.resume_for; });
  add({.key = "resume.bytes",
       .range = NumberRange{0, kGiB},
       .changeable = true,
       .unit = "bytes",
       .help = "How many bytes of them it stores for all links of one identity. Beyond that the "
               "topic with the most bytes loses its oldest message."},
      [](Config& c) { return &c.limits.resume_bytes_max; });
  add({.key = "bytes_per_second",
       .range = NumberRange{0, 1e12},
       .changeable = true,
       .unit = "bytes/s",
       .help =
           "Highest rate at which this side sends on all links together, in bytes of IP packets, "
           "as a provider bills them. Logins, refused visitors and a relay's connection count, and "
           "take at most half of it from the links. "
           "Identities have equal shares. Urgent messages count and are never held back. 0: no "
           "limit; below 1000 means 1000."},
      [](Config& c) { return &c.limits.bytes_per_second_max; });
  add({.key = "link.bytes_per_second",
       .range = NumberRange{0, 1e12},
       .changeable = true,
       .unit = "bytes/s",
       .help = "Highest rate at which this side sends on one link, in bytes of IP packets. Urgent "
               "messages count and are never held back. 0: no limit; below 1000 means 1000."},
      [](Config& c) { return &c.limits.outbox.bytes_per_second_max; });
  add({.key = "congestion_control",
       .fallback = "auto",
       .syntax = check_word,
       .help = "TCP congestion control. `auto`: cubic, or bbr while the network loses packets all "
               "the time. `host`: the host's setting. Otherwise the name of the algorithm."},
      [](Config& c) { return &c.socket.congestion_control; });
}

// Limits of a link, of all peers together, and of unauthenticated connections. Limits that nobody
// would change are defaults of the options of each part (core/*/options.hpp, core/link/account.hpp,
// core/ports/net_options.hpp).
void add_limits(Rows& rows) {
  const auto add = row_adder(rows, "Limits");
  const auto of_server = row_adder(rows, "Limits", UsedBy::kServer);
  add("max_message_size", {1024, kGiB}, "bytes",
      "Largest message accepted from a peer. Without `memory_max` and this key: at most a third "
      "of the memory that `memory_max` then is.",
      [](Config& c) { return &c.limits.reassembly.message_bytes_max; });
  add("memory_max", {1 << 20, 1024 * kGiB}, "bytes",
      "Memory that all peers together may use at this side; a single link can use a third "
      "(docs/security.md section 5). Beyond it data is dropped (`memory` in the status) or "
      "refused. If it is not set, it is a quarter of the memory of this machine or of its cgroup, "
      "from 64 MiB up to this default.",
      [](Config& c) { return &c.limits.account.memory_bytes_max; });
  add("picture_cpu", {0.05, 64}, "cores",
      "Processor time that encoding and decoding video may use in each second. Identities take "
      "turns; beyond it there are fewer pictures.",
      [](Config& c) { return &c.picture_cpu; });
  of_server("connections_max", {1, 10000}, "",
            "Clients at the same time, including lost ones that may return. One identity may have "
            "half of them, but at least 8.",
            [](Config& c) { return &c.limits.links_max; });
  const AccountOptions account;
  of_server({.key = "limits.offences_per_minute",
             .fallback = 60 * Duration(std::chrono::seconds(1)) / account.offence_period,
             .range = NumberRange{1, 1'000'000},
             .help = "How many links of one identity may be ended in a minute for what no peer may "
                     "do (4002, 4006, 4009, 4010); " +
                     std::to_string(account.offences_at_once) +
                     " of them at once. After more, its next login waits, or is refused, for at "
                     "most a minute."});
}

}  // namespace

const std::vector<KeySpec>& key_table() {
  static const Rows table = [] {
    Rows rows;
    add_listen(rows);
    add_dial(rows);
    add_robot(rows);
    add_login(rows);
    add_login_methods(rows);
    add_files(rows);
    add_tls(rows);
    add_names(rows);
    add_operation(rows);
    add_audit(rows);
    add_connection(rows);
    add_limits(rows);
    add_rule_rows(rows);
    return rows;
  }();
  return table;
}

}  // namespace connect_bridge
