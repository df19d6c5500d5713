#include "net/tls/tls.hpp"

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <boost/asio/error.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ssl/error.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "core/base/base64.hpp"
#include "core/base/hex.hpp"
#include "core/base/sha256.hpp"
#include "core/ports/pin.hpp"
#include "core/wire/text.hpp"
#include "net/tls/certified.hpp"
#include "net/tls/openssl_owned.hpp"

namespace connect_bridge {
namespace {

// Empty, or why the file cannot be read. OpenSSL's own text would not name it.
std::string unreadable(const std::string& what, const std::string& file) {
  std::FILE* const opened = std::fopen(file.c_str(), "rb");
  if (opened == nullptr) {
    return what + " '" + file + "' cannot be read: " + std::strerror(errno);
  }
  std::fclose(opened);
  return {};
}

std::string openssl_reason() {
  const unsigned long code = ERR_peek_last_error();
  ERR_clear_error();
  const char* const reason = code == 0 ? nullptr : ERR_reason_error_string(code);
  return reason == nullptr ? "unknown error" : reason;
}

// The certificate chain and its key into the context. Empty, or what is wrong.
std::string load_pair(SSL_CTX* context, const std::string& certificate, const std::string& key) {
  if (auto problem = unreadable("the certificate", certificate); !problem.empty()) return problem;
  if (auto problem = unreadable("the private key", key); !problem.empty()) return problem;
  ERR_clear_error();
  if (SSL_CTX_use_certificate_chain_file(context, certificate.c_str()) != 1) {
    return "the certificate '" + certificate + "' is not a PEM certificate: " + openssl_reason();
  }
  // Without this, a key with a passphrase would ask for it on the terminal.
  SSL_CTX_set_default_passwd_cb(context, [](char*, int, int, void*) { return 0; });
  if (SSL_CTX_use_PrivateKey_file(context, key.c_str(), SSL_FILETYPE_PEM) != 1) {
    const bool mismatch = ERR_GET_REASON(ERR_peek_last_error()) == X509_R_KEY_VALUES_MISMATCH;
    const std::string reason = openssl_reason();
    if (mismatch) {
      return "the private key '" + key + "' does not belong to the certificate '" + certificate +
             "'";
    }
    return "the private key '" + key + "' is not a PEM key without a passphrase: " + reason;
  }
  if (SSL_CTX_check_private_key(context) != 1) {
    return "the private key '" + key + "' does not belong to the certificate '" + certificate + "'";
  }
  return {};
}

std::string load_authorities(SSL_CTX* context, const std::string& file) {
  if (auto problem = unreadable("the CA file", file); !problem.empty()) return problem;
  ERR_clear_error();
  if (SSL_CTX_load_verify_locations(context, file.c_str(), nullptr) != 1) {
    return "the CA file '" + file + "' has no PEM certificate: " + openssl_reason();
  }
  return {};
}

// Mozilla's "intermediate" (https://wiki.mozilla.org/Security/Server_Side_TLS) without the suites
// of finite-field Diffie-Hellman, which no client with TLS 1.2 needs: TLS 1.2 with forward secrecy
// and AEAD, and TLS 1.3.
constexpr char kSuitesOf12[] =
    "ECDHE-ECDSA-AES128-GCM-SHA256:ECDHE-RSA-AES128-GCM-SHA256:"
    "ECDHE-ECDSA-AES256-GCM-SHA384:ECDHE-RSA-AES256-GCM-SHA384:"
    "ECDHE-ECDSA-CHACHA20-POLY1305:ECDHE-RSA-CHACHA20-POLY1305";
constexpr char kSuitesOf13[] =
    "TLS_AES_128_GCM_SHA256:TLS_AES_256_GCM_SHA384:TLS_CHACHA20_POLY1305_SHA256";
constexpr char kGroups[] = "X25519:P-256:P-384";

TlsContext make_context(std::string& problem) {
  try {
    auto context = std::make_shared<asio::ssl::context>(asio::ssl::context::tls);
    SSL_CTX* const native = context->native_handle();
    // The client's order of suites is used: a machine without AES in hardware asks for ChaCha20
    // first.
    SSL_CTX_set_options(native, SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION);
    ERR_clear_error();
    if (SSL_CTX_set_min_proto_version(native, TLS1_2_VERSION) != 1 ||
        SSL_CTX_set_cipher_list(native, kSuitesOf12) != 1 ||
        SSL_CTX_set_ciphersuites(native, kSuitesOf13) != 1 ||
        SSL_CTX_set1_groups_list(native, kGroups) != 1) {
      problem = "TLS cannot start: this OpenSSL lacks what it needs: " + openssl_reason();
      return nullptr;
    }
    // An idle connection need not keep 34 kB of buffers.
    SSL_CTX_set_mode(native, SSL_MODE_RELEASE_BUFFERS);
    return context;
  } catch (const std::exception& error) {
    problem = std::string{"TLS cannot start: "} + error.what();
    return nullptr;
  }
}

std::string name_text(const X509_NAME* of) {
  const OpenSslOwned<BIO> name{BIO_new(BIO_s_mem())};
  if (!name) return {};
  X509_NAME_print_ex(name.get(), of, 0, XN_FLAG_RFC2253);
  return written_to(name.get());
}

// ", issued by 'CN=Example Intermediate'": the authority that the server's certificates lead to.
// The server chooses the name.
std::string issuer_shown(SSL* tls) {
  constexpr std::size_t kNameBytes = 80;
  const STACK_OF(X509)* const chain = SSL_get_peer_cert_chain(tls);
  if (chain == nullptr || sk_X509_num(chain) <= 0) return {};
  const X509_NAME* issuer = X509_get_issuer_name(sk_X509_value(chain, 0));
  // Each certificate is issued by the next (RFC 8446 section 4.4.2).
  for (int i = 1; i < sk_X509_num(chain); ++i)
    if (X509_NAME_cmp(X509_get_subject_name(sk_X509_value(chain, i)), issuer) == 0)
      issuer = X509_get_issuer_name(sk_X509_value(chain, i));
  return ", issued by '" + to_text(name_text(issuer), kNameBytes) + "'";
}

// " but for 'robot2'": the name in the server's certificate, which the server chooses.
std::string name_shown(SSL* tls) {
  constexpr std::size_t kNameBytes = 80;
  const STACK_OF(X509)* const chain = SSL_get_peer_cert_chain(tls);
  if (chain == nullptr || sk_X509_num(chain) <= 0) return {};
  const std::string name = name_in(sk_X509_value(chain, 0));
  return name.empty() ? "" : " but for '" + to_text(name, kNameBytes) + "'";
}

Failure certificate_failure(long result, const std::string& name, SSL* tls) {
  switch (result) {
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH:
      return {Cause::kCertificateName, "the server's certificate is not for '" + name + "'" +
                                           name_shown(tls) +
                                           " (connect to a name that is in it, or set tls.pin)"};
    case X509_V_ERR_INVALID_PURPOSE:
      return {Cause::kCertificatePurpose, "the server shows a certificate that is not for servers"};
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return {Cause::kCertificateExpired, "the server's certificate has expired"};
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return {Cause::kCertificateEarly,
              "the server's certificate is not valid yet (is this machine's clock right?)"};
    case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
    case X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN:
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
    case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT:
      return {Cause::kCertificateForeign,
              "the server's certificate is from an unknown authority" + issuer_shown(tls) + " (" +
                  X509_verify_cert_error_string(result) + "; tls.ca names the authority to trust)"};
    default:
      return {Cause::kCertificateForeign, std::string{"the server's certificate is refused: "} +
                                              X509_verify_cert_error_string(result)};
  }
}

bool is_tls_reason(const ErrorCode& error, int reason) {
  return error.category() == asio::error::get_ssl_category() &&
         ERR_GET_REASON(static_cast<unsigned long>(error.value())) == reason;
}

}  // namespace

TlsContext make_server_tls(const TlsOptions& options, std::string& problem) {
  TlsContext context = make_context(problem);
  if (!context) return nullptr;
  SSL_CTX* const native = context->native_handle();
  problem = load_pair(native, options.certificate_file, options.private_key_file);
  if (problem.empty() && !options.ca_file.empty()) {
    problem = load_authorities(native, options.ca_file);
    SSL_CTX_set_verify(native, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT,
                       nullptr);  // mutant: client_certificate
    SSL_CTX_set_client_CA_list(native, SSL_load_client_CA_file(options.ca_file.c_str()));
  }
  // Resumption would need a session id context when clients show certificates, and gains little for
  // long connections.
  SSL_CTX_set_session_cache_mode(native, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_options(native, SSL_OP_NO_TICKET);
  SSL_CTX_set_num_tickets(native, 0);
  return problem.empty() ? context : nullptr;
}

TlsContext make_client_tls(const TlsOptions& options, std::string& problem) {
  TlsContext context = make_context(problem);
  if (!context) return nullptr;
  SSL_CTX* const native = context->native_handle();
  if (!options.certificate_file.empty()) {
    problem = load_pair(native, options.certificate_file, options.private_key_file);
    if (!problem.empty()) return nullptr;
  }
  // A pin is enough alone: the rest of the certificate is then not vouched for by anybody.
  const bool by_pin_alone =
      !options.pins.empty() && options.ca_file.empty();  // mutant: pin_and_authority
  SSL_CTX_set_verify(native, by_pin_alone ? SSL_VERIFY_NONE : SSL_VERIFY_PEER, nullptr);
  if (!options.ca_file.empty()) {
    problem = load_authorities(native, options.ca_file);
  } else {
    SSL_CTX_set_default_verify_paths(native);
  }
  return problem.empty() ? context : nullptr;
}

void expect_server(SSL* tls, const std::string& name) {
  ErrorCode no_address;
  static_cast<void>(asio::ip::make_address(name, no_address));
  const bool is_name = static_cast<bool>(no_address);
  // RFC 6066: an address literal must not be sent as server name.
  if (is_name) SSL_set_tlsext_host_name(tls, name.c_str());
  X509_VERIFY_PARAM* const expected = SSL_get0_param(tls);
  X509_VERIFY_PARAM_set_hostflags(expected, X509_CHECK_FLAG_NO_PARTIAL_WILDCARDS);
  // A certificate knows no zones.
  const int set =
      is_name ? X509_VERIFY_PARAM_set1_host(expected, name.c_str(), name.size())
              : X509_VERIFY_PARAM_set1_ip_asc(expected, name.substr(0, name.find('%')).c_str());
  // Otherwise a certificate for any name would do.
  if (set != 1) SSL_set_verify(tls, SSL_VERIFY_PEER, [](int, X509_STORE_CTX*) { return 0; });
}

std::string pin_of(SSL* tls) {
  const OpenSslOwned<X509> certificate{SSL_get1_peer_certificate(tls)};
  return certificate ? pin_of_certificate(certificate.get()) : "";
}

std::string pin_of_certificate(const X509* certificate) {
  unsigned char* encoded = nullptr;
  const int size = i2d_X509_PUBKEY(X509_get_X509_PUBKEY(certificate), &encoded);
  if (size <= 0) return {};
  const Digest digest = sha256({encoded, static_cast<std::size_t>(size)});
  OPENSSL_free(encoded);
  return to_base64(digest);
}

std::string login_word(SSL* tls) {
  static constexpr std::string_view kLabel = "EXPORTER-ros2-connect-login";
  Digest word{};
  const bool made =
      tls != nullptr && SSL_export_keying_material(tls, word.data(), word.size(), kLabel.data(),
                                                   kLabel.size(), nullptr, 0, 0) == 1;
  return made ? to_hex(word) : std::string{};
}

Failure pin_failure(SSL* tls, const std::vector<std::string>& pins) {
  if (pins.empty()) return {};
  const std::string seen = pin_of(tls);
  const auto is_seen = [&](const std::string& entry) { return pin_in(entry).key == seen; };
  if (std::any_of(pins.begin(), pins.end(), is_seen)) return {};
  return {Cause::kOtherKey,
          "the server's public key has the pin " + seen + ", which is not in tls.pin"};
}

std::string subject_text(const X509* certificate) {
  return name_text(X509_get_subject_name(certificate));
}

std::string certificate_text(asio::ssl::context& context) {
  const X509* const certificate = SSL_CTX_get0_certificate(context.native_handle());
  const OpenSslOwned<BIO> end{BIO_new(BIO_s_mem())};
  if (certificate == nullptr || !end) return {};
  ASN1_TIME_print(end.get(), X509_get0_notAfter(certificate));
  return "certificate of '" + subject_text(certificate) + "', valid until " + written_to(end.get());
}

bool is_plain_http(const ErrorCode& error) {
  return is_tls_reason(error, SSL_R_HTTP_REQUEST);
}

Failure failure_of(const ErrorCode& error, SSL* tls, const std::string& name) {
  if (is_tls_reason(error, SSL_R_CERTIFICATE_VERIFY_FAILED) && tls != nullptr) {
    const long result = SSL_get_verify_result(tls);
    if (SSL_is_server(tls) == 0) return certificate_failure(result, name, tls);
    return {Cause::kClientCertificate, std::string{"the client's certificate is refused: "} +
                                           X509_verify_cert_error_string(result)};
  }
  if (is_tls_reason(error, SSL_R_WRONG_VERSION_NUMBER))
    return {Cause::kTlsToPlainPort,
            "the other end does not speak TLS on this port (ws:// instead of wss://?)"};
  if (is_plain_http(error)) return {Cause::kPlainToTlsPort, "plain HTTP on a TLS port"};
  if (is_tls_reason(error, SSL_R_PEER_DID_NOT_RETURN_A_CERTIFICATE))
    return {Cause::kClientCertificate, "the client showed no certificate"};
  if (is_tls_reason(error, SSL_R_TLSV13_ALERT_CERTIFICATE_REQUIRED))
    return {Cause::kClientCertificate, "the server wants a client certificate"};
  if (is_tls_reason(error, SSL_R_TLSV1_ALERT_UNKNOWN_CA))
    return {Cause::kClientCertificate,
            "the other end does not trust the authority of our certificate"};
  for (const int refused :
       {SSL_R_SSLV3_ALERT_BAD_CERTIFICATE, SSL_R_SSLV3_ALERT_CERTIFICATE_EXPIRED,
        SSL_R_SSLV3_ALERT_CERTIFICATE_REVOKED, SSL_R_SSLV3_ALERT_CERTIFICATE_UNKNOWN,
        SSL_R_SSLV3_ALERT_UNSUPPORTED_CERTIFICATE})
    if (is_tls_reason(error, refused))
      return {Cause::kClientCertificate, "the other end refuses our certificate"};
  if (is_tls_reason(error, SSL_R_TLSV1_UNRECOGNIZED_NAME))
    return {Cause::kNameNotServed, "no '" + name + "' is served there"};
  if (error == asio::error::eof || error == asio::ssl::error::stream_truncated)
    return {Cause::kConnectionLost, "the other end ended the connection"};
  if (error == asio::error::connection_reset || error == asio::error::broken_pipe)
    return {Cause::kConnectionLost, "the other end reset the connection"};
  if (error == asio::error::connection_refused)
    return {Cause::kPortClosed, "connection refused (nobody listens there)"};
  if (error == asio::error::timed_out)
    return {Cause::kNoAnswer, "no answer from the other end (TCP timed out)"};
  if (error == asio::error::network_unreachable)
    return {Cause::kNoRoute, "this machine has no route there (" + error.message() + ")"};
  if (error == asio::error::host_unreachable)
    return {Cause::kNoAnswer,
            error.message() + " (no machine has this address there, or a firewall refuses)"};
  const bool waits = error == asio::error::host_not_found_try_again;
  if (waits || error == asio::error::host_not_found || error == asio::error::no_data)
    return {waits ? Cause::kResolverSilent : Cause::kHostUnknown,
            "the name '" + name + "' cannot be resolved: " + error.message()};
  const bool is_tls = error.category() == asio::error::get_ssl_category();
  return {is_tls ? Cause::kTlsFails : Cause::kOther, error.message()};
}

}  // namespace connect_bridge
