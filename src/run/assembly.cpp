#include "run/assembly.hpp"

#include <openssl/rand.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "access/login/credential.hpp"
#include "access/login/file_trust.hpp"
#include "access/login/pairing_login.hpp"
#include "core/base/check.hpp"
#include "core/video/picture.hpp"
#include "net/http/status_door.hpp"
#include "net/tcp/descriptors.hpp"
#include "net/tcp/system_now.hpp"
#include "net/tls/certified.hpp"
#include "ops/doctor/host_check.hpp"
#include "run/supervisor.hpp"
#include "run/surroundings.hpp"

namespace connect_bridge {
namespace {

// Matching takes some milliseconds on one machine; longer on a busy machine and with other RMWs.
constexpr Duration kMatching = std::chrono::milliseconds(60);

// Unauthenticated connections beyond those that the core keeps: refused ones, and ones that are
// closing.
constexpr std::size_t kStrangersSpare = 64;

std::uint64_t secret_random() {
  std::uint64_t random = 0;
  CONNECT_CHECK(RAND_bytes(reinterpret_cast<unsigned char*>(&random), sizeof random) == 1);
  return random;
}

SocketOptions socket_options(const Config& config) {
  SocketOptions sockets = config.socket;
  // The kernel's timeout must not end a connection before `dead_after` does.
  const auto dead_after =
      std::chrono::duration_cast<std::chrono::milliseconds>(config.limits.dead_after);
  sockets.user_timeout = std::max(sockets.user_timeout, dead_after + std::chrono::seconds(5));
  return sockets;
}

void add(std::vector<Failure>& to, Cause cause, const std::vector<std::string>& problems) {
  for (const std::string& problem : problems) to.push_back({cause, problem});
}

void assemble_login(const Config& config, const Start& start, BridgeParts& parts,
                    Assembly& assembly) {
  AuthOptions auth{config.auth, std::nullopt};
  if (start.folder) {
    auth.pairing = PairingOptions{.file = start.folder->invited_file(),
                                  .shown = start.folder->invitation_file(),
                                  .strict_modes = config.auth.strict_modes,
                                  .of_robots = config.robot == Role::kClient};
    for (const auto& entry : config.identity_names) auth.pairing->taken.push_back(entry.second);
    for (const Rule& rule : config.policy.rules()) append(auth.pairing->taken, rule.identities);
  }
  if (auth.token.empty() && auth.token_file.empty())
    if (const char* token = std::getenv(kTokenVariable)) auth.token = token;
  AuthSetup setup = make_authenticator(auth, system_now());
  add(assembly.problems, setup.cause, setup.problems);
  append(assembly.warnings, setup.warnings);
  parts.authenticator = std::move(setup.authenticator);
}

void assemble_server(const Config& config, const Start& start, BridgeParts& parts,
                     Assembly& assembly) {
  parts.certificate_login = config.auth.method == kCertificateLogin;
  if (!parts.certificate_login) assemble_login(config, start, parts, assembly);
  parts.listen = config.listen;
  // The core counts links after login; unauthenticated connections must not take their places.
  parts.listen.pending_max = config.limits.strangers_max + kStrangersSpare;
  parts.listen.connections_max = config.limits.links_max + parts.listen.pending_max;
  const std::string too_many =
      descriptors_problem(config.limits.links_max,
                          parts.listen.pending_max + 2 * StatusDoor::kConnectionsMax,  // and socket
                          raise_descriptors());
  if (!too_many.empty()) assembly.problems.push_back({Cause::kValueWrong, too_many});
  if (!config.tls.certificate_file.empty()) parts.listen.tls = parts.config.tls;
  if (!parts.listen.relay) return;
  const CredentialOptions at_relay{"token", "", config.relay_token_file, config.auth.strict_modes};
  const Credential token = client_credential(at_relay);
  for (const std::string& problem : token.problems)
    assembly.problems.push_back(
        {token.cause, "listen.relay.token_file, which is read as " + problem});
  append(assembly.warnings, token.warnings);
  parts.listen.relay->tls.distrusted = parts.config.tls.distrusted;
  parts.listen.relay->code = start.relay_code;
  if (!start.relay_code.empty()) parts.listen.relay->keep = start.keep;
  parts.listen.relay->token = [at_relay] {
    const Credential now = client_credential(at_relay);
    return now.problems.empty() ? std::string(now.bytes.begin(), now.bytes.end()) : std::string{};
  };
}

void assemble_client(const Config& config, const Start& start, BridgeParts& parts,
                     Assembly& assembly) {
  // TLS verifies the certificate before the login.
  const std::string secret = config.auth.method == kCertificateLogin ? "none" : config.auth.method;
  const CredentialOptions options{secret, config.auth.token, config.auth.token_file,
                                  config.auth.strict_modes};
  if (!options.token_file.empty()) parts.credential_file.emplace(options);
  Credential credential = client_credential(options);
  add(assembly.problems, credential.cause, credential.problems);
  append(assembly.warnings, credential.warnings);
  parts.side.credential = std::move(credential.bytes);
  parts.side.login_method = config.auth.method;
  if (start.joining) {
    const std::string& shown = start.joining->credential;
    parts.joining = start.joining;
    parts.side.login_method = kPairingLogin;
    parts.side.credential = {shown.begin(), shown.end()};
  }
  parts.dial = config.dial;
  parts.dial.tls = parts.config.tls;
  parts.dial.tls.pins_by_invitation = start.folder.has_value();
  parts.dial.timeout =
      std::chrono::duration_cast<std::chrono::milliseconds>(parts.side.dial_timeout);
}

}  // namespace

Assembly assemble(const Config& config, const std::string& node, const Start& start) {
  Assembly assembly;
  BridgeParts parts;
  parts.config = config;
  parts.config.tls.distrusted = config.auth.strict_modes ? who_else_may_change : nullptr;
  parts.side = side_options(config);
  parts.folder = start.folder;
  parts.side.node = node;
  parts.side.drive_switch = !config.is_robot();
  parts.side.matching = kMatching;
  parts.side.pictures = video::available();
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
  if (parts.config.role != Role::kServer || parts.config.listen_address != "systemd") return {};
  const Variable variable = environment();
  PassedSockets passed = passed_sockets(getpid(), variable("LISTEN_PID"), variable("LISTEN_FDS"));
  parts.listen.sockets = std::move(passed.sockets);
  return passed.problem;
}

void hide_environment() {
  if (char* token = std::getenv(kTokenVariable)) {
    std::memset(token, 'x', std::strlen(token));
    unsetenv(kTokenVariable);
  }
}

}  // namespace connect_bridge
