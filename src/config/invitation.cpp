#include "config/invitation.hpp"

#include <algorithm>
#include <string_view>

#include "config/syntax.hpp"
#include "core/base/base64.hpp"
#include "core/base/hex.hpp"

namespace connect_bridge {
namespace {

constexpr std::string_view kDialed = "wss://";
constexpr std::size_t kPinBytes = 32;
constexpr std::size_t kLineCodeSize = 64;
constexpr std::string_view kForRobot = ".robot";

// Converts base64 of RFC 4648 section 4 to section 5, which shells and URLs leave unchanged.
std::string to_url_safe(std::string pin) {
  while (!pin.empty() && pin.back() == '=') pin.pop_back();
  std::replace(pin.begin(), pin.end(), '+', '-');
  std::replace(pin.begin(), pin.end(), '/', '_');
  return pin;
}

std::string text_of(std::string_view scheme, const Invitation& line) {
  return std::string{scheme} + line.url.substr(kDialed.size()) + "#" + line.code + "." +
         to_url_safe(line.pin);
}

// `url` is always set; an empty `pin` means that the rest is wrong.
Invitation read_line(const std::string& text, std::string_view scheme, std::size_t code_size) {
  Invitation read;
  const std::string_view rest =
      text.starts_with(scheme) ? std::string_view{text}.substr(scheme.size()) : "";
  const auto hash = rest.find('#');
  read.url = std::string{kDialed}.append(rest.substr(0, hash));
  const std::string secret{hash == std::string_view::npos ? "" : rest.substr(hash + 1)};
  const auto dot = secret.find('.');
  if (!syntax::parse_url(read.url) || dot != code_size) return read;
  Bytes code(code_size / 2);
  const auto pin = from_base64url(secret.substr(dot + 1));
  if (!from_hex(secret.substr(0, dot), code) || !pin || pin->size() != kPinBytes) return read;
  read.code = secret.substr(0, dot);
  read.pin = to_base64(*pin);
  return read;
}

}  // namespace

std::string to_text(const Invitation& invitation) {
  return text_of(kInvitationScheme, invitation).append(invitation.invites_robot ? kForRobot : "");
}

Invitation parse_invitation(const std::string& text, std::string& problem) {
  const bool for_robot = text.ends_with(kForRobot);
  Invitation parsed = read_line(text.substr(0, text.size() - (for_robot ? kForRobot.size() : 0)),
                                kInvitationScheme, kCodeSize);
  parsed.invites_robot = for_robot;
  if (parsed.pin.empty())
    problem =
        "the invitation is not complete: expected what 'server --pair' prints, between "
        "quotation marks, wss+pair://HOST:PORT/#CODE.PIN";
  return parsed;
}

std::string two_of_a_kind(const Invitation& invitation, bool is_robot) {
  if (invitation.invites_robot == is_robot) return {};
  return is_robot
             ? "a robot made this invitation ('server --pair'), and --robot says that this end "
               "is one, too: leave out --robot; or, if the robot is here, start 'server "
               "--pair --drive' at the operator and use what that prints"
             : "this invitation is for a robot ('server --pair --drive' made it): start it "
               "there, with client --robot; or, if the operator is here, start 'server "
               "--pair' at the robot and use what that prints";
}

std::string to_relay_line(const Invitation& line) {
  return text_of(kRelayLineScheme, line);
}

Invitation parse_relay_line(const std::string& text, std::string& problem) {
  Invitation parsed = read_line(text, kRelayLineScheme, kLineCodeSize);
  if (parsed.pin.empty() || syntax::check_relay_url(parsed.url))
    problem =
        "the registration command is not complete: expected what 'relay --robot' prints, between "
        "quotation marks, wss+relay://ROBOT@HOST:PORT/#CODE.PIN";
  return parsed;
}

}  // namespace connect_bridge
