// Login by a JSON Web Token (RFC 7519) that somebody else has signed.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "auth/authenticator.hpp"
#include "auth/file_watch.hpp"
#include "auth/jwt_keys.hpp"

namespace connect_bridge {

// Who the token is of: "sub", the groups, "exp", which must be there. Nothing of it is parsed but
// its header before the signature is right.
[[nodiscard]] Judgement judge_jwt(std::string_view token, const std::vector<JwtKey>& keys,
                                  const JwtOptions& options, Stamp now);

class JwtLogin : public Authenticator {
 public:
  JwtLogin(JwtOptions options, std::vector<JwtKey> keys, FileWatch file)
      : options_(std::move(options)), keys_(std::move(keys)), file_(std::move(file)) {}

  [[nodiscard]] Judgement judge(const Attempt& attempt, Stamp now) override;
  // Whose key is not in the file any more is sent away.
  [[nodiscard]] Refreshed refresh(Stamp now) override;

 private:
  const JwtOptions options_;
  std::vector<JwtKey> keys_;
  FileWatch file_;
};

[[nodiscard]] std::vector<JwtKey> read_jwt_key_file(const std::string& file,
                                                    std::vector<std::string>& problems);

}  // namespace connect_bridge
