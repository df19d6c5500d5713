// Login by a JSON Web Token (RFC 7519) that an identity provider has signed.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "access/login/authenticator.hpp"
#include "access/plugins/jwt_keys.hpp"
#include "access/plugins/key_source.hpp"
#include "access/plugins/plugin.hpp"

namespace connect_bridge {

struct JwtOptions {
  std::string issuer;                   // required value of "iss"
  std::string audience;                 // required value of "aud", or one of its values
  std::string groups_claim = "groups";  // a list of names, or one
};

// Judges a token. Its identity has "sub", the groups, and "exp", which is required. Only the header
// is parsed before the signature is verified. `unknown_key` (may be null) is set if no key has the
// type and name in the token.
[[nodiscard]] Judgement judge_jwt(std::string_view token, const std::vector<JwtKey>& keys,
                                  const JwtOptions& options, Stamp now,
                                  bool* unknown_key = nullptr);

class JwtLogin : public Authenticator {
 public:
  JwtLogin(JwtOptions options, std::unique_ptr<KeySource> source);

  [[nodiscard]] Judgement judge(const Attempt& attempt, Stamp now) override;
  // Takes changed keys, and withdraws logins whose key was removed.
  [[nodiscard]] Refreshed refresh(Stamp now) override;

 private:
  const JwtOptions options_;
  std::vector<JwtKey> keys_;
  std::unique_ptr<KeySource> source_;
};

// Makes the login from the options jwt_keys, jwt_issuer, jwt_audience, jwt_groups_claim, https_ca.
// A file of keys must be valid; an address may be unreachable for a while.
[[nodiscard]] AuthSetup make_jwt_login(PluginOptions options);

}  // namespace connect_bridge
