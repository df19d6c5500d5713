#include "net/tls/certified.hpp"

#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <limits>
#include <vector>

#include "core/ports/pin.hpp"
#include "core/wire/text.hpp"
#include "net/tls/openssl_owned.hpp"
#include "net/tls/tls.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kNameBytesMax = 128;
constexpr std::size_t kGroupsMax = 32;
constexpr std::time_t kEndMax = std::numeric_limits<Stamp>::max() / kStampSecond;

// An authority may sign any text: only a name that can be shown is accepted.
std::optional<std::string> name_of(const ASN1_STRING* text) {
  unsigned char* utf8 = nullptr;
  const int size = ASN1_STRING_to_UTF8(&utf8, text);
  if (size < 0) return std::nullopt;
  std::string name{reinterpret_cast<const char*>(utf8), static_cast<std::size_t>(size)};
  OPENSSL_free(utf8);
  if (name.empty() || name.size() > kNameBytesMax || !is_text(name)) return std::nullopt;
  return name;
}

// All entries of this kind, or nullopt if one of them is not a valid name.
std::optional<std::vector<std::string>> entries(X509_NAME* subject, int kind) {
  std::vector<std::string> found;
  for (int at = -1; (at = X509_NAME_get_index_by_NID(subject, kind, at)) >= 0;) {
    const auto name = name_of(X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at)));
    if (!name) return std::nullopt;
    found.push_back(*name);
  }
  return found;
}

std::optional<std::string> alternative_name(X509* certificate) {
  const OpenSslOwned<GENERAL_NAMES> names{static_cast<GENERAL_NAMES*>(
      X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr))};
  for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const GENERAL_NAME* const entry = sk_GENERAL_NAME_value(names.get(), i);
    if (entry->type == GEN_EMAIL || entry->type == GEN_DNS || entry->type == GEN_URI)
      return name_of(entry->d.ia5);
  }
  return std::nullopt;
}

Certified refused(std::string reason) {
  return {std::nullopt, std::move(reason)};
}

}  // namespace

Certified certified_by(SSL* tls) {
  const OpenSslOwned<X509> shown{tls == nullptr ? nullptr : SSL_get1_peer_certificate(tls)};
  if (!shown) return refused("no certificate was shown");
  if (SSL_get_verify_result(tls) != X509_V_OK) return refused("the certificate was not verified");
  X509_NAME* const subject = X509_get_subject_name(shown.get());
  const auto names = entries(subject, NID_commonName);
  const auto groups = entries(subject, NID_organizationName);
  if (!names || !groups || names->size() > 1 || groups->size() > kGroupsMax)
    return refused("the subject of the certificate is not one name with at most 32 groups");
  const auto name = names->empty() ? alternative_name(shown.get()) : names->front();
  if (!name) return refused("the certificate has neither a common name nor an alternative one");
  return {Identity{*name, *groups, certified_until(tls)}, {}};
}

Identity server_of(SSL* tls, const TlsOptions& options, const std::string& name) {
  if (tls == nullptr) return {};
  for (const std::string& entry : options.pins) {
    const Pin pin = pin_in(entry);
    if (pin.is.name.empty() || pin.key != pin_of(tls)) continue;
    return pin.is;
  }
  if (options.ca_file.empty()) {
    Identity by_name;
    if (options.pins.empty()) by_name.name = name;
    return by_name;
  }
  Identity certified = certified_by(tls).identity.value_or(Identity{});
  certified.expires = 0;  // of a link, a server's certificate is no end
  return certified;
}

std::string name_in(X509* certificate) {
  const auto names = entries(X509_get_subject_name(certificate), NID_commonName);
  const bool named = names && !names->empty();
  return (named ? names->front() : alternative_name(certificate)).value_or("");
}

Stamp end_of(const X509* certificate) {
  std::tm time{};
  ASN1_TIME_to_tm(X509_get0_notAfter(certificate), &time);
  const std::time_t seconds = ::timegm(&time);
  // The year 9999 means "never" (RFC 5280 section 4.1.2.5), and is beyond what a stamp can say.
  return seconds > kEndMax ? 0 : static_cast<Stamp>(seconds) * kStampSecond;
}

std::string day_of(Stamp stamp) {
  const std::time_t seconds = stamp / kStampSecond;
  std::tm time{};
  ::gmtime_r(&seconds, &time);
  std::array<char, 16> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d", &time);
  return text.data();
}

Stamp certified_until(const SSL* tls) {
  const STACK_OF(X509)* const chain = tls == nullptr ? nullptr : SSL_get0_verified_chain(tls);
  Stamp first = 0;
  for (int i = 0; i < sk_X509_num(chain); ++i) {  // -1 without a chain
    const Stamp end = end_of(sk_X509_value(chain, i));
    if (end != 0) first = first == 0 ? end : std::min(first, end);
  }
  return first;
}

}  // namespace connect_bridge
