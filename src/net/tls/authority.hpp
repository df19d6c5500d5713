// A private certificate authority: makes certificates for a server and its clients.
#pragma once

#include <string>
#include <vector>

namespace connect_bridge {

struct CertificateOrder {
  std::string folder;                // is made if it is missing, for its owner alone
  std::vector<std::string> hosts;    // names and addresses of the server; empty: no server's
  std::vector<std::string> clients;  // a certificate for each; the name becomes its subject
  std::vector<std::string> groups;   // of these clients, as organizations of the subject
  int days = 365;  // how long they are valid, but no longer than the authority: ten years
};

struct CertificatesMade {
  std::string problem;             // empty, or what is wrong; then nothing was written
  std::vector<std::string> files;  // what was written
  std::string pin;                 // of the server's key (tls.pin); empty: none was made
  // The day on which they end with their authority, if that is before the one that was asked for.
  std::string shortened_to;
};

// The authority is ca.crt with ca.key; an existing one signs the new certificates, unless it has
// expired. The server's files are server.crt and server.key, a client's client-NAME.crt and
// client-NAME.key. Keys are for ECDSA (P-256); only the owner may read their files. No file is
// overwritten.
[[nodiscard]] CertificatesMade make_certificates(const CertificateOrder& order);

// A server's, valid for ten years, for peers who go by its pin: server.crt and server.key, and no
// authority, whose key could sign nothing that they need. What is wrong, or nothing.
[[nodiscard]] std::string make_pinned_certificate(const std::string& folder,
                                                  const std::string& host);

// The pin (tls.pin) of the key in a PEM certificate. `problem` is set if there is none.
[[nodiscard]] std::string pin_of_file(const std::string& file, std::string& problem);

}  // namespace connect_bridge
