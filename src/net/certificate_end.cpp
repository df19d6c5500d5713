#include "net/certificate_end.hpp"

#include <openssl/ssl.h>

#include <array>
#include <ctime>

#include "net/certified.hpp"

namespace connect_bridge {
namespace {

std::string date_of(Stamp stamp) {
  const std::time_t seconds = stamp / kStampSecond;
  std::tm time{};
  ::gmtime_r(&seconds, &time);
  std::array<char, 16> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d", &time);
  return text.data();
}

// "12 days", to the nearest
std::string days_of(Stamp time) {
  constexpr Stamp kDay = 24 * 3600 * kStampSecond;
  if (time < kDay) return "less than a day";
  const Stamp days = (time + kDay / 2) / kDay;
  return std::to_string(days) + (days == 1 ? " day" : " days");
}

}  // namespace

std::optional<std::string> CertificateEnd::take_line(const Now& now) {
  const Stamp left = end_ - now.system;
  if (end_ == 0 || left >= kSoon.count() || (next_ && now.steady < *next_)) return std::nullopt;
  next_ = now.steady + kPeriod;
  const std::string when =
      left > 0 ? " ends in " + days_of(left) : " ended " + days_of(-left) + " ago";
  return "TLS: the certificate of " + (name_.empty() ? "this side" : name_) + when + ", on " +
         date_of(end_) + ": replace it (ctl certs)";
}

CertificateEnd end_of_certificate(asio::ssl::context& context) {
  X509* const shown = SSL_CTX_get0_certificate(context.native_handle());
  return shown == nullptr ? CertificateEnd{} : CertificateEnd{name_in(shown), end_of(shown)};
}

}  // namespace connect_bridge
