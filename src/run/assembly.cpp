#include "run/assembly.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <random>
#include <string_view>

#include "auth/credential.hpp"
#include "auth/pairing_login.hpp"
#include "config/syntax.hpp"
#include "net/certified.hpp"
#include "net/https.hpp"
#include "ros/types/type_supports.hpp"
#include "run/activation.hpp"

namespace connect_bridge {
namespace {

// On one machine it takes some milliseconds; on a busy machine, and with other RMWs, longer.
constexpr Duration kMatching = std::chrono::milliseconds(60);

// Connections without a login, beside those that the core keeps: refusals and ends under way.
constexpr std::size_t kStrangersSpare = 64;
constexpr int kHandshakeSecondsAtOnce = 3;

Stamp wall_clock() {
  return static_cast<Stamp>(std::time(nullptr)) * kStampSecond;
}

std::uint64_t secret_random() {
  static thread_local std::random_device device;
  return (std::uint64_t{device()} << 32) | device();
}

SocketOptions socket_options(const Config& config) {
  SocketOptions sockets;
  sockets.unsent_bytes_max = config.socket.not_sent_bytes;
  sockets.receive_packets_per_second = static_cast<double>(config.socket.packets_per_second);
  sockets.receive_bytes_per_second = static_cast<double>(config.socket.bytes_per_second);
  sockets.congestion_control = config.socket.congestion_control;
  // What the kernel gives up must not end a connection before `dead_after` does.
  const auto dead_after =
      std::chrono::duration_cast<std::chrono::milliseconds>(config.limits.dead_after);
  sockets.user_timeout = std::max(sockets.user_timeout, dead_after + std::chrono::seconds(5));
  return sockets;
}

Variable environment() {
  return [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string{value ? value : ""};
  };
}

std::optional<HttpProxy> http_proxy(const std::optional<HttpProxyConfig>& proxy) {
  if (!proxy) return std::nullopt;
  return HttpProxy{proxy->host, proxy->port, proxy->login, proxy->login_key};
}

void append(std::vector<std::string>& to, const std::vector<std::string>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

ToldBy told_by(const std::string& word) {
  if (word == "forwarded") return ToldBy::kForwarded;
  return word == "proxy_protocol" ? ToldBy::kProxyProtocol : ToldBy::kXForwardedFor;
}

void assemble_login(const Config& config, const Start& start, BridgeParts& parts,
                    Assembly& assembly) {
  AuthOptions auth;
  auth.pairing = start.pairing;
  auth.method = config.auth.method;
  auth.token = config.auth.token;
  auth.token_file = config.auth.token_file;
  if (auth.token.empty() && auth.token_file.empty())
    if (const char* token = std::getenv(kTokenVariable)) auth.token = token;
  auth.jwt = {config.auth.jwt_keys,       {},
              config.auth.jwt_issuer,     config.auth.jwt_audience,
              config.auth.jwt_algorithms, config.auth.jwt_groups_claim};
  auth.jwt.keys_address = syntax::parse_http_url(config.auth.jwt_keys);
  if (const auto service = syntax::parse_http_url(config.auth.service)) auth.service = *service;
  auth.fetch =
      [https = std::make_shared<Https>(config.auth.https_ca, http_proxy(config.auth.https_proxy))](
          const HttpRequest& request) { return https->fetch(request); };
  auth.plugin = config.auth.plugin;
  auth.plugin_options = config.auth.plugin_options;
  AuthSetup setup = make_authenticator(auth, wall_clock());
  append(assembly.problems, setup.problems);
  append(assembly.warnings, setup.warnings);
  parts.authenticator = std::move(setup.authenticator);
}

void assemble_limits(const Config& config, ListenOptions& listen) {
  // The core counts links after login; strangers must not take the place of those.
  listen.pending_max = config.limits.strangers_max + kStrangersSpare;
  listen.connections_max = config.limits.links_max + listen.pending_max;
  listen.pending_per_address_max = config.listen.address_strangers_max;
  const int all = config.listen.handshakes_per_second;
  listen.handshakes_at_once = kHandshakeSecondsAtOnce * all;
  listen.handshake_period = Duration(std::chrono::seconds(1)) / all;
  const int own = config.listen.address_handshakes_per_second;
  listen.address_handshakes_at_once = kHandshakeSecondsAtOnce * own;
  listen.address_handshake_period = Duration(std::chrono::seconds(1)) / own;
}

void assemble_server(const Config& config, const Start& start, BridgeParts& parts,
                     Assembly& assembly) {
  parts.certificate_login = config.auth.method == kCertificateLogin;
  if (!parts.certificate_login) assemble_login(config, start, parts, assembly);
  parts.listen.addresses = syntax::listen_addresses(config.listen.address);
  parts.listen.port = config.listen.port;
  parts.listen.path = config.listen.path;
  parts.listen.trusted_proxies = config.listen.trusted_proxies;
  parts.listen.told_by = told_by(config.listen.proxy_header);
  parts.listen.proxies_only = config.listen.proxies_only;
  assemble_limits(config, parts.listen);
  if (!config.tls.certificate.empty())
    parts.listen.tls = ServerTls{config.tls.certificate, config.tls.private_key, config.tls.ca};
}

void assemble_client(const Config& config, const Start& start, BridgeParts& parts,
                     Assembly& assembly) {
  // TLS has verified the certificate before the login.
  const std::string secret = config.auth.method == kCertificateLogin ? "none" : config.auth.method;
  const CredentialOptions options{secret, config.auth.token, config.auth.token_file};
  if (!options.token_file.empty()) parts.credential_file.emplace(options);
  Credential credential = client_credential(options);
  append(assembly.problems, credential.problems);
  append(assembly.warnings, credential.warnings);
  parts.side.credential = std::move(credential.bytes);
  parts.side.login_method = config.auth.method;
  if (start.joining) {
    const std::string& shown = start.joining->credential;
    parts.joining = start.joining;
    parts.side.login_method = kPairingLogin;
    parts.side.credential = {shown.begin(), shown.end()};
  }
  parts.dial.url = {config.dial.tls, config.dial.host, config.dial.port, config.dial.target};
  parts.dial.proxy = http_proxy(config.dial.proxy);
  parts.dial.tls.ca_file = config.tls.ca;
  parts.dial.tls.server_name = config.tls.server_name;
  parts.dial.tls.pins = config.tls.pins;
  parts.dial.tls.certificate_file = config.tls.certificate;
  parts.dial.tls.private_key_file = config.tls.private_key;
  parts.dial.timeout =
      std::chrono::duration_cast<std::chrono::milliseconds>(parts.side.dial_timeout);
}

}  // namespace

Assembly assemble(const Config& config, const std::string& node, const Start& start) {
  Assembly assembly;
  BridgeParts parts;
  parts.config = config;
  parts.side = side_options(config);
  parts.folder = start.folder;
  parts.side.node = node;
  parts.side.matching = kMatching;
  parts.side.secret_random = &secret_random;
  parts.sockets = socket_options(config);
  if (config.role == Role::kServer) {
    assemble_server(config, start, parts, assembly);
  } else {
    assemble_client(config, start, parts, assembly);
  }
  if (assembly.problems.empty()) assembly.parts = std::move(parts);
  return assembly;
}

std::string take_sockets(BridgeParts& parts) {
  if (parts.config.role != Role::kServer || parts.config.listen.address != "systemd") return {};
  const Variable variable = environment();
  PassedSockets passed = passed_sockets(getpid(), variable("LISTEN_PID"), variable("LISTEN_FDS"));
  parts.listen.sockets = std::move(passed.sockets);
  return passed.problem;
}

Surroundings surroundings() {
  Surroundings s;
  const char* token = std::getenv(kTokenVariable);
  s.token_in_environment = token && *token;
  s.variable = environment();
  s.readable = [](const std::string& file) { return access(file.c_str(), R_OK) == 0; };
  s.installed = [types = std::make_shared<ros::TypeSupports>()](const std::string& type) {
    return !std::holds_alternative<ros::Refusal>(types->message(type, ""));
  };
  return s;
}

void hide_secrets(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument(argv[i]);
    for (const std::string_view key :
         {"auth.token:=", "auth.plugin_options:=", "http_proxy_login:="}) {
      const auto at = argument.find(key);
      if (at != std::string_view::npos)
        std::memset(argv[i] + at + key.size(), 'x', argument.size() - at - key.size());
    }
    const auto code = argument.find('#');
    if (argument.starts_with(kInvitationScheme) && code != std::string_view::npos)
      std::memset(argv[i] + code + 1, 'x', argument.size() - code - 1);
  }
  if (char* token = std::getenv(kTokenVariable)) {
    std::memset(token, 'x', std::strlen(token));
    unsetenv(kTokenVariable);
  }
}

}  // namespace connect_bridge
