// Login by a JSON Web Token (RFC 7519) that an identity provider has signed.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "auth/authenticator.hpp"
#include "auth/jwt_keys.hpp"
#include "auth/key_source.hpp"

namespace connect_bridge {

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

}  // namespace connect_bridge
