// The one line that a server that pairs prints, and that its client is started with.
#pragma once

#include <string>

namespace connect_bridge {

// "wss+pair://robot.local:9090/#CODE.PIN". Behind the '#' stands a secret, for some minutes.
struct Invitation {
  std::string url;   // "wss://robot.local:9090/"
  std::string code;  // kCodeSize hexadecimal digits
  std::string pin;   // of the server's key: SHA-256 in base64, as in tls.pin
};

inline constexpr std::size_t kCodeSize = 32;
inline constexpr char kInvitationScheme[] = "wss+pair://";

[[nodiscard]] std::string to_text(const Invitation& invitation);
// On return either `problem` is empty, or it says what is wrong, without the code.
[[nodiscard]] Invitation parse_invitation(const std::string& text, std::string& problem);

}  // namespace connect_bridge
