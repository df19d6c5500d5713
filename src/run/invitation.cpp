#include "run/invitation.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "config/syntax.hpp"

namespace connect_bridge {
namespace {

constexpr std::string_view kScheme = kInvitationScheme;
constexpr std::string_view kDialed = "wss://";
constexpr std::size_t kPinSize = 43;  // of 32 bytes, without the '=' at its end

// Base64 of RFC 4648 section 4 to that of section 5, which a shell and a URL leave as it is.
std::string to_url_safe(std::string pin) {
  while (!pin.empty() && pin.back() == '=') pin.pop_back();
  std::replace(pin.begin(), pin.end(), '+', '-');
  std::replace(pin.begin(), pin.end(), '/', '_');
  return pin;
}

std::string from_url_safe(std::string pin) {
  std::replace(pin.begin(), pin.end(), '-', '+');
  std::replace(pin.begin(), pin.end(), '_', '/');
  return pin + "=";
}

bool all(std::string_view text, bool (*allowed)(unsigned char)) {
  return std::all_of(text.begin(), text.end(),
                     [&](char c) { return allowed(static_cast<unsigned char>(c)); });
}

bool is_hex(unsigned char c) {
  return std::isdigit(c) != 0 || (c >= 'a' && c <= 'f');
}

bool is_url_safe(unsigned char c) {
  return std::isalnum(c) != 0 || c == '-' || c == '_';
}

}  // namespace

std::string to_text(const Invitation& invitation) {
  return kInvitationScheme + invitation.url.substr(kDialed.size()) + "#" + invitation.code + "." +
         to_url_safe(invitation.pin);
}

Invitation parse_invitation(const std::string& text, std::string& problem) {
  Invitation parsed;
  const std::string_view rest =
      text.starts_with(kScheme) ? std::string_view{text}.substr(kScheme.size()) : "";
  const auto hash = rest.find('#');
  parsed.url = std::string{kDialed}.append(rest.substr(0, hash));
  const std::string secret{hash == std::string_view::npos ? "" : rest.substr(hash + 1)};
  const auto dot = secret.find('.');
  if (!syntax::parse_url(parsed.url) || dot != kCodeSize ||
      secret.size() != kCodeSize + 1 + kPinSize || !all(secret.substr(0, dot), is_hex) ||
      !all(secret.substr(dot + 1), is_url_safe)) {
    problem =
        "the invitation is not complete: expected what 'server --pair' prints, between "
        "quotation marks, wss+pair://HOST:PORT/#CODE.PIN";
    return parsed;
  }
  parsed.code = secret.substr(0, dot);
  parsed.pin = from_url_safe(secret.substr(dot + 1));
  return parsed;
}

}  // namespace connect_bridge
