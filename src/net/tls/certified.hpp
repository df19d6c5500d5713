// The peer's identity from the certificate that it has shown.
#pragma once

#include <openssl/ssl.h>

#include <optional>
#include <string>

#include "core/policy/policy.hpp"
#include "core/ports/net_options.hpp"

namespace connect_bridge {

// The login method that a client names; its credential is empty.
inline constexpr char kCertificateLogin[] = "certificate";

// The identity, or the reason (for our log) why there is none.
struct Certified {
  std::optional<Identity> identity;
  std::string reason;
};

// To be called after a handshake that has requested and verified a certificate. The name is the
// subject's common name, without one the first of the alternative names (mail address, name, URI);
// the groups are the organizations of the subject; it expires with the certificate. `tls` may be
// null.
[[nodiscard]] Certified certified_by(SSL* tls);

// Whom a server has proved to be, at a client, after a handshake that was accepted by these
// options: by a pin's entry with a name, that name and the groups behind it; by an authority of
// `ca_file`, as certified_by(), without an end; by the system's authorities `name`, which the
// certificate is for. By a pin's entry without a name it is nobody. `tls` may be null.
[[nodiscard]] Identity server_of(SSL* tls, const TlsOptions& options, const std::string& name);

// The subject's common name, without one the first of the alternative names; empty: neither.
[[nodiscard]] std::string name_in(X509* certificate);

// When it ends; 0: never.
[[nodiscard]] Stamp end_of(const X509* certificate);

// The day in UTC, "2026-12-08".
[[nodiscard]] std::string day_of(Stamp stamp);

// When the first of the certificates ends by which the peer was verified; 0: never, or it has shown
// none. `tls` may be null.
[[nodiscard]] Stamp certified_until(const SSL* tls);

}  // namespace connect_bridge
