#include "auth/authenticator.hpp"

#include "auth/secret.hpp"
#include "auth/token_table.hpp"

namespace connect_bridge {
namespace {

// Everybody may, as nobody in particular.
class NoLogin : public Authenticator {
 public:
  void check(const Attempt&, const Now&, Verdict verdict) override { verdict(Identity{}, {}); }
};

// Nothing slows attempts down: behind a proxy everybody has one address, and who has the right
// token gets in whatever others do there. 16 random characters cannot be guessed at any rate.
class TokenLogin : public Authenticator {
 public:
  explicit TokenLogin(TokenTable table) : table_(std::move(table)) {}

  void check(const Attempt& attempt, const Now& now, Verdict verdict) override {
    if (attempt.method != "token") {
      return verdict(std::nullopt, "login method '" + attempt.method + "' instead of 'token'");
    }
    TokenTable::Found found = table_.find(attempt.credential, now.system);
    verdict(std::move(found.identity), std::move(found.reason));
  }

 private:
  TokenTable table_;
};

}  // namespace

AuthSetup make_authenticator(const AuthOptions& options, const Now& now) {
  AuthSetup setup;
  if (options.method == "none") {
    setup.authenticator = std::make_unique<NoLogin>();
    return setup;
  }
  if (options.method != "token") {
    setup.problems.push_back("auth.method '" + options.method + "': expected 'token' or 'none'");
    return setup;
  }
  TokenTable table;
  if (!options.token.empty()) table.add_single(options.token, "auth.token", setup.problems);
  if (!options.token_file.empty()) {
    std::string problem;
    auto text = read_secret_file(options.token_file, problem);
    if (text) {
      table.read(*text, options.token_file, now.system, setup.problems, setup.warnings);
      wipe(*text);
      const std::string exposed = exposure_warning(options.token_file);
      if (!exposed.empty()) setup.warnings.push_back("auth.token_file " + exposed);
    } else {
      setup.problems.push_back("auth.token_file " + problem);
    }
  }
  if (setup.problems.empty() && table.size() == 0) {
    setup.problems.emplace_back(
        "auth.token_file or auth.token: method 'token' needs at least one token");
  }
  if (!setup.problems.empty()) return setup;
  setup.authenticator = std::make_unique<TokenLogin>(std::move(table));
  return setup;
}

}  // namespace connect_bridge
