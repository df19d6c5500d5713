// TLS contexts from files, and errors with their cause and a text that a person can act on.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/ports/failure.hpp"
#include "core/ports/net_options.hpp"
#include "net/tcp/transport.hpp"

namespace connect_bridge {

using TlsContext = std::shared_ptr<asio::ssl::context>;

// Null with `problem` set: the file and what is wrong with it.
TlsContext make_server_tls(const TlsOptions& options, std::string& problem);
TlsContext make_client_tls(const TlsOptions& options, std::string& problem);

// Client, before the handshake: the expected server (name or address literal), if verification is
// on.
void expect_server(SSL* tls, const std::string& name);

// SHA-256 of the certificate's public key (SPKI), in base64; empty: none.
std::string pin_of_certificate(const X509* certificate);
// The pin of the certificate that the peer has shown; empty: it has shown none.
std::string pin_of(SSL* tls);
// A word that only the two ends of this connection can make (RFC 5705); empty: it has no TLS. In
// its next ClientHello it shows the server, in plain, that the client has logged in before.
[[nodiscard]] std::string login_word(SSL* tls);
// Client, after the handshake: nothing if the server's key has one of the pins, or there are none.
[[nodiscard]] Failure pin_failure(SSL* tls, const std::vector<std::string>& pins);

// "CN=robot,O=ops" (RFC 2253); what is no text in it is escaped.
std::string subject_text(const X509* certificate);

// Describes the context's own certificate: "certificate of 'CN=robot', valid until ..."; empty: it
// has none.
std::string certificate_text(asio::ssl::context& context);

// Why a connection failed. `tls` may be null; `name`: as for expect_server().
[[nodiscard]] Failure failure_of(const ErrorCode& error, SSL* tls, const std::string& name);

// A plain HTTP request arrived where a TLS hello was expected.
bool is_plain_http(const ErrorCode& error);

}  // namespace connect_bridge
