#include "core/base/sha256.hpp"

#include <openssl/evp.h>

#include "core/base/check.hpp"

namespace connect_bridge {

Digest sha256(ByteView bytes) {
  Digest digest{};
  unsigned size = 0;
  const int done =
      EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr);
  CONNECT_CHECK(done == 1 && size == digest.size());
  return digest;
}

}  // namespace connect_bridge
