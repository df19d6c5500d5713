// Login by a JSON Web Token (RFC 7519) that somebody else has signed.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "auth/authenticator.hpp"
#include "auth/jwt_keys.hpp"
#include "auth/key_source.hpp"

namespace connect_bridge {

// Who the token is of: "sub", the groups, "exp", which must be there. Nothing of it is parsed but
// its header before the signature is right. `unknown_key` (may be null) is set if no key is of the
// kind and name that the token asks for.
[[nodiscard]] Judgement judge_jwt(std::string_view token, const std::vector<JwtKey>& keys,
                                  const JwtOptions& options, Stamp now,
                                  bool* unknown_key = nullptr);

class JwtLogin : public Authenticator {
 public:
  JwtLogin(JwtOptions options, std::unique_ptr<KeySource> source);

  [[nodiscard]] Judgement judge(const Attempt& attempt, Stamp now) override;
  // Whose key is not there any more is sent away.
  [[nodiscard]] Refreshed refresh(Stamp now) override;

 private:
  const JwtOptions options_;
  std::vector<JwtKey> keys_;
  std::unique_ptr<KeySource> source_;
};

}  // namespace connect_bridge
