#include "net/http/status_request.hpp"

#include <openssl/x509v3.h>

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <boost/beast/core/string.hpp>
#include <optional>
#include <string_view>

namespace connect_bridge {
namespace {

// The host of "robot:9091" or "[::1]:9091" without its port; nullopt: the text has another form.
std::optional<std::string> host_without_port(std::string_view text) {
  const bool bracket = text.starts_with('[');
  const std::size_t end = bracket ? text.find(']') : text.find(':');
  if (bracket && end == std::string_view::npos) return std::nullopt;
  const std::string_view rest = text.substr(std::min(text.size(), bracket ? end + 1 : end));
  if (!rest.empty() &&
      (rest[0] != ':' || rest.find_first_not_of("0123456789", 1) != std::string_view::npos))
    return std::nullopt;
  return std::string{bracket ? text.substr(1, end - 1) : text.substr(0, end)};
}

// A web page whose name leads to this machine (DNS rebinding) sends that name here. It cannot send
// an address, or "localhost"; names in our certificate are ours.
bool is_own_host(std::string_view text, SSL* tls) {
  const auto host = host_without_port(text);
  if (!host) return false;
  ErrorCode no_address;
  asio::ip::make_address(*host, no_address);
  if (!no_address || beast::iequals(*host, "localhost")) return true;  // mutant: foreign_host
  X509* const own = tls ? SSL_get_certificate(tls) : nullptr;
  return own && X509_check_host(own, host->data(), host->size(), 0, nullptr) == 1;
}

}  // namespace

StatusRefusal wrong_with(const StatusGet& request, SSL* tls) {
  if (request.method() != http::verb::get) return {405, "Only GET is answered here."};
  if (request.count(http::field::host) != 1) return {400, "One Host is needed."};
  const auto host = request[http::field::host];
  if (!is_own_host({host.data(), host.size()}, tls))
    return {421,
            "This host is not served here: use localhost, an IP address, or a name of the "
            "certificate."};
  if (!request.target().starts_with('/')) return {400, "A path is needed."};
  if (request.count(http::field::transfer_encoding) + request.count(http::field::content_length))
    return {400, "A request has no body here."};
  // A browser adds these headers to the requests of a page. The page may not read the answer, but
  // could send requests on and on.
  const auto site = request["Sec-Fetch-Site"];
  if (request.count(http::field::origin) ||
      !(site.empty() || site == "same-origin" || site == "none"))
    return {403, "Pages of elsewhere may not ask here."};
  return {};
}

}  // namespace connect_bridge
