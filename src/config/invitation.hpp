// Texts that one program prints and another one is started with: an invitation from a pairing
// server to its client, and the registration command from a relay to a robot.
#pragma once

#include <string>

namespace connect_bridge {

// An invitation, "wss+pair://robot.local:9090/#CODE.PIN", or "...#CODE.PIN.robot" if it invites the
// robot. The part behind the '#' is a secret for some minutes.
struct Invitation {
  std::string url;             // "wss://robot.local:9090/"
  std::string code;            // kCodeSize hexadecimal digits
  std::string pin;             // of the server's key: SHA-256 in base64, as in tls.pin
  bool invites_robot = false;  // the server is at the operator
};

inline constexpr std::size_t kCodeSize = 32;
inline constexpr char kInvitationScheme[] = "wss+pair://";

// The invitation as its text, with the code.
[[nodiscard]] std::string to_text(const Invitation& invitation);
// Parses an invitation. On failure `problem` describes the mistake, without the code; else it stays
// empty.
[[nodiscard]] Invitation parse_invitation(const std::string& text, std::string& problem);

// The mistake and its cure if both ends are robots, or both operators; empty: neither. `is_robot`:
// whether the end that was started with the invitation is set as the robot.
[[nodiscard]] std::string two_of_a_kind(const Invitation& invitation, bool is_robot);

// "wss+relay://robot7@relay.example:443/#CODE.PIN": the argument of a registration command. `code`
// has 64 hexadecimal digits and gives the name to one token, once; `pin` is of the relay's key.
inline constexpr char kRelayLineScheme[] = "wss+relay://";
[[nodiscard]] std::string to_relay_line(const Invitation& line);
[[nodiscard]] Invitation parse_relay_line(const std::string& text, std::string& problem);

}  // namespace connect_bridge
