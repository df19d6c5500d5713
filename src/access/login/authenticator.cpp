#include "access/login/authenticator.hpp"

#include <filesystem>

#include "access/login/pairing_login.hpp"
#include "access/login/plugin_login.hpp"
#include "access/login/token_login.hpp"

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
  setup.cause = Cause::kTokenMissing;
  if (!options.token.empty()) table.add_single(options.token, "auth.token", setup.problems);
  if (!options.token_file.empty()) {  // the configuration has one of the two
    watch.emplace(options.token_file);
    std::vector<Failure> problems;
    table =
        read_token_file(options.token_file, options.strict_modes, now, problems, setup.warnings);
    if (!problems.empty()) setup.cause = problems.front().cause;
    for (Failure& problem : problems) setup.problems.push_back(std::move(problem.text));
  }
  if (setup.problems.empty() && table.size() == 0 && !options.pairing) {
    setup.problems.emplace_back(
        "auth.token_file or auth.token: method 'token' needs at least one token");
  }
  if (!setup.problems.empty()) return;
  auto login = std::make_unique<TokenLogin>(std::move(table), std::move(watch),
                                            options.strict_modes, options.once);
  if (options.pairing) {
    setup.authenticator =
        std::make_unique<PairingLogin>(*options.pairing, options.token_file, std::move(login));
  } else {
    setup.authenticator = std::move(login);
  }
}

// Our own libraries are beside the program, where it is built and where it is installed.
std::string own_plugin(const std::string& method) {
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe");
  return program.parent_path() / ("auth_" + method + ".so");
}

}  // namespace

AuthSetup make_authenticator(const AuthOptions& options, Stamp now) {
  AuthSetup setup;
  if (options.method == "none") {
    setup.authenticator = std::make_unique<NoLogin>();
  } else if (options.method == "token") {
    set_up_tokens(options, now, setup);
  } else if (options.method == "plugin") {
    setup = PluginLogin::load(options.plugin, options.plugin_options);
  } else if (options.method == "jwt" || options.method == "service") {
    setup = PluginLogin::load(own_plugin(options.method), options.plugin_options);
  } else {
    setup.problems.push_back("auth.method '" + options.method +
                             "': expected 'token', 'jwt', 'service', 'plugin' or 'none'");
  }
  return setup;
}

}  // namespace connect_bridge
