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
  std::string issuer;                   // "iss" must be this one
  std::string audience;                 // "aud" must be this one or name it
  std::string groups_claim = "groups";  // a list of names, or one
};

// The identity of a token: "sub", the groups, and "exp", which is required. Only the header is
// parsed before the signature is verified. `unknown_key` (may be null) is set if there is no key of
// the type and name that the token asks for.
[[nodiscard]] Judgement judge_jwt(std::string_view token, const std::vector<JwtKey>& keys,
                                  const JwtOptions& options, Stamp now,
                                  bool* unknown_key = nullptr);

class JwtLogin : public Authenticator {
 public:
  JwtLogin(JwtOptions options, std::unique_ptr<KeySource> source);

  [[nodiscard]] Judgement judge(const Attempt& attempt, Stamp now) override;
  // Ends logins whose key was removed.
  [[nodiscard]] Refreshed refresh(Stamp now) override;

 private:
  const JwtOptions options_;
  std::vector<JwtKey> keys_;
  std::unique_ptr<KeySource> source_;
};

// By the options jwt_keys, jwt_issuer, jwt_audience, jwt_groups_claim, https_ca. A
// file of keys must be valid; an address may be unreachable for a while.
[[nodiscard]] AuthSetup make_jwt_login(PluginOptions options);

}  // namespace connect_bridge
