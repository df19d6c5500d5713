#include "auth/authenticator.hpp"

#include "auth/jwt_login.hpp"
#include "auth/pairing_login.hpp"
#include "auth/plugin_login.hpp"
#include "auth/service_login.hpp"
#include "auth/token_login.hpp"

namespace connect_bridge {
namespace {

// Everybody may log in, without an identity.
class NoLogin : public Authenticator {
 public:
  Judgement judge(const Attempt&, Stamp) override { return {Identity{}, {}}; }
};

void set_up_tokens(const AuthOptions& options, Stamp now, AuthSetup& setup) {
  TokenTable table;
  std::optional<FileWatch> watch;
  if (!options.token.empty()) table.add_single(options.token, "auth.token", setup.problems);
  if (!options.token_file.empty()) {  // the configuration has one of the two
    watch.emplace(options.token_file);
    table = read_token_file(options.token_file, now, setup.problems, setup.warnings);
  }
  if (setup.problems.empty() && table.size() == 0 && !options.pairing) {
    setup.problems.emplace_back(
        "auth.token_file or auth.token: method 'token' needs at least one token");
  }
  if (!setup.problems.empty()) return;
  auto login = std::make_unique<TokenLogin>(std::move(table), std::move(watch));
  if (options.pairing) {
    setup.authenticator =
        std::make_unique<PairingLogin>(*options.pairing, options.token_file, std::move(login));
  } else {
    setup.authenticator = std::move(login);
  }
}

// A file must be valid at the start; an address may be unreachable for a while.
void set_up_jwt(const AuthOptions& options, AuthSetup& setup) {
  std::unique_ptr<KeySource> source;
  if (options.jwt.keys_address) {
    source = std::make_unique<KeyAddress>(*options.jwt.keys_address, options.fetch);
  } else {
    source = std::make_unique<KeyFile>(options.jwt.keys_file);
  }
  auto login = std::make_unique<JwtLogin>(options.jwt, std::move(source));
  std::vector<std::string> problems = login->refresh(0).problems;
  if (options.jwt.keys_address) {
    setup.warnings.insert(setup.warnings.end(), problems.begin(), problems.end());
  } else {
    setup.problems.insert(setup.problems.end(), problems.begin(), problems.end());
  }
  if (setup.problems.empty()) setup.authenticator = std::move(login);
}

}  // namespace

AuthSetup make_authenticator(const AuthOptions& options, Stamp now) {
  AuthSetup setup;
  if (options.method == "none") {
    setup.authenticator = std::make_unique<NoLogin>();
  } else if (options.method == "token") {
    set_up_tokens(options, now, setup);
  } else if (options.method == "jwt") {
    set_up_jwt(options, setup);
  } else if (options.method == "plugin") {
    std::string problem;
    setup.authenticator = PluginLogin::load(options.plugin, options.plugin_options, problem);
    if (!setup.authenticator) setup.problems.push_back("auth.plugin: " + problem);
  } else if (options.method == "service") {
    setup.authenticator = std::make_unique<ServiceLogin>(options.service, options.fetch);
  } else {
    setup.problems.push_back("auth.method '" + options.method +
                             "': expected 'token', 'jwt', 'service', 'plugin' or 'none'");
  }
  return setup;
}

}  // namespace connect_bridge
