#include "net/tls/certificate_end.hpp"

#include <openssl/ssl.h>

#include "net/tls/certified.hpp"
#include "net/tls/tls.hpp"

namespace connect_bridge {
namespace {

// "12 days", to the nearest
std::string days_of(Stamp time) {
  constexpr Stamp kDay = 24 * 3600 * kStampSecond;
  if (time < kDay) return "less than a day";
  const Stamp days = (time + kDay / 2) / kDay;
  return std::to_string(days) + (days == 1 ? " day" : " days");
}

bool ends_before(const X509* one, const X509* other) {
  const Stamp end = end_of(one), other_end = end_of(other);
  return end != 0 && (other_end == 0 || end < other_end);
}

}  // namespace

std::optional<std::string> CertificateEnd::take_line(const Now& now) {
  const Stamp left = end_ - now.system;
  if (end_ == 0 || left >= kSoon.count() || (next_ && now.steady < *next_)) return std::nullopt;
  next_ = now.steady + kPeriod;
  const std::string when =
      left > 0 ? " ends in " + days_of(left) : " ended " + days_of(-left) + " ago";
  const std::string own = "the certificate of " + (name_.empty() ? "this side" : name_);
  if (above_.empty())
    return "TLS: " + own + when + ", on " + day_of(end_) + ": replace it (ctl certs)";
  return "TLS: '" + above_ + "' in the chain of " + own + when + ", on " + day_of(end_) +
         ": replace the chain";
}

CertificateEnd end_of_certificate(asio::ssl::context& context) {
  SSL_CTX* const native = context.native_handle();
  X509* const shown = SSL_CTX_get0_certificate(native);
  if (shown == nullptr) return {};
  STACK_OF(X509)* chain = nullptr;
  SSL_CTX_get0_chain_certs(native, &chain);
  const X509* first = shown;
  for (int i = 0; i < sk_X509_num(chain); ++i) {  // -1 without a chain
    const X509* const next = sk_X509_value(chain, i);
    if (ends_before(next, first)) first = next;
  }
  return {name_in(shown), end_of(first), first == shown ? "" : subject_text(first)};
}

}  // namespace connect_bridge
