#include "auth/authenticator.hpp"

#include "auth/backoff.hpp"
#include "auth/secret.hpp"
#include "auth/token_table.hpp"

namespace connect_bridge {
namespace {

// Everybody may, as nobody in particular.
class NoLogin : public Authenticator {
 public:
  void check(const Attempt&, const Now&, Verdict verdict) override { verdict(Identity{}, {}); }
};

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

// Lets through to the method only as many attempts as the back-off of their address allows.
class Guard : public Authenticator {
 public:
  Guard(std::unique_ptr<Authenticator> method, const BackoffOptions& options)
      : method_(std::move(method)), backoff_(std::make_shared<Backoff>(options)) {}

  void check(const Attempt& attempt, const Now& now, Verdict verdict) override {
    if (!backoff_->take(attempt.peer, now.steady)) {
      return verdict(std::nullopt, "too many failed logins from this address, not checked");
    }
    method_->check(attempt, now,
                   [backoff = backoff_, peer = attempt.peer, began = now.steady,
                    verdict = std::move(verdict)](std::optional<Identity> who, std::string why) {
                     if (who) backoff->give_back(peer, began);
                     verdict(std::move(who), std::move(why));
                   });
  }

 private:
  std::unique_ptr<Authenticator> method_;
  std::shared_ptr<Backoff> backoff_;
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
  BackoffOptions backoff;
  backoff.failures_max = options.failures_max;
  backoff.failures_per_second = options.failures_per_second;
  backoff.addresses_max = options.addresses_max;
  setup.authenticator =
      std::make_unique<Guard>(std::make_unique<TokenLogin>(std::move(table)), backoff);
  return setup;
}

}  // namespace connect_bridge
