#include "core/base/sha256.hpp"

#define OPENSSL_API_COMPAT 10100
#include <openssl/sha.h>

namespace connect_bridge {

// By the functions that OpenSSL 3 calls deprecated: the others load all of its algorithms first,
// which is 2 MB of a process without TLS.
Digest sha256(ByteView bytes) {
  Digest digest{};
  SHA256_CTX context;
  SHA256_Init(&context);
  SHA256_Update(&context, bytes.data(), bytes.size());
  SHA256_Final(digest.data(), &context);
  return digest;
}

}  // namespace connect_bridge
