// Keys that verify JSON Web Tokens, and the verification of one signature.
//
// A key is used for one algorithm, that of its type: the algorithm in a token only selects among
// the keys, and never decides how a key is used. OpenSSL verifies, because the JWT libraries of
// Debian 12 and Ubuntu 22.04 (libjwt 1.10, cjose 0.6) do not support EdDSA.
#pragma once

#include <openssl/types.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/bytes.hpp"

namespace connect_bridge {

class JwtKey {
 public:
  // `algorithm`: "RS256", "ES256", "EdDSA" (Ed25519) or "HS256". `id`: the "kid" of its tokens, or
  // empty.
  JwtKey(std::string algorithm, std::string id, std::shared_ptr<EVP_PKEY> key);
  JwtKey(std::string id, Bytes secret);  // HS256

  [[nodiscard]] const std::string& algorithm() const { return algorithm_; }
  [[nodiscard]] const std::string& id() const { return id_; }
  // Identifies the key; not a secret.
  [[nodiscard]] const std::string& fingerprint() const { return fingerprint_; }
  [[nodiscard]] bool verifies(std::string_view signed_text, ByteView signature) const;

 private:
  std::string algorithm_;
  std::string id_;
  std::shared_ptr<EVP_PKEY> key_;  // null: HS256
  Bytes secret_;
  std::string fingerprint_;
};

inline constexpr std::size_t kJwtKeysMax = 64;

// Reads a JWKS (RFC 7517), or public keys in PEM. Skips keys for other uses. Everything wrong goes
// to `problems`: private keys, keys that are too weak, no key at all, too many keys.
[[nodiscard]] std::vector<JwtKey> read_jwt_keys(std::string_view text, const std::string& source,
                                                std::vector<std::string>& problems);

}  // namespace connect_bridge
