// Who the other end is by the certificate that it has shown.
#pragma once

#include <openssl/ssl.h>

#include <optional>
#include <string>

#include "core/policy/policy.hpp"

namespace connect_bridge {

// What a client names as its method of login; the credential beside it is empty.
inline constexpr char kCertificateLogin[] = "certificate";

// The identity, or a reason for our log why there is none.
struct Certified {
  std::optional<Identity> identity;
  std::string reason;
};

// After a handshake that wanted a certificate and has verified it. The name is the subject's common
// name, without one the first of the alternative names (mail address, name, URI); the groups are
// the organizations of the subject; it expires with the certificate. `tls` may be null.
[[nodiscard]] Certified certified_by(SSL* tls);

}  // namespace connect_bridge
