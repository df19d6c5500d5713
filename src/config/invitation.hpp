// The lines that one program prints and another one is started with: a server that pairs for its
// client, a relay for a robot.
#pragma once

#include <string>

namespace connect_bridge {

// "wss+pair://robot.local:9090/#CODE.PIN", or "...#CODE.PIN.robot" if it invites the robot. Behind
// the '#' stands a secret, for some minutes.
struct Invitation {
  std::string url;             // "wss://robot.local:9090/"
  std::string code;            // kCodeSize hexadecimal digits
  std::string pin;             // of the server's key: SHA-256 in base64, as in tls.pin
  bool invites_robot = false;  // the server is the operator's
};

inline constexpr std::size_t kCodeSize = 32;
inline constexpr char kInvitationScheme[] = "wss+pair://";

[[nodiscard]] std::string to_text(const Invitation& invitation);
// On return either `problem` is empty, or it says what is wrong, without the code.
[[nodiscard]] Invitation parse_invitation(const std::string& text, std::string& problem);

// What is wrong if both ends of it are robots, or both operators, with the cure; empty: nothing.
// `is_robot`: whether the end that was started with it is said to be one.
[[nodiscard]] std::string two_of_a_kind(const Invitation& invitation, bool is_robot);

// "wss+relay://robot7@relay.example:443/#CODE.PIN": what a robot needs of its relay. `code` has 64
// hexadecimal digits and gives the name to one token, once; `pin` is of the relay's key.
inline constexpr char kRelayLineScheme[] = "wss+relay://";
[[nodiscard]] std::string to_relay_line(const Invitation& line);
[[nodiscard]] Invitation parse_relay_line(const std::string& text, std::string& problem);

}  // namespace connect_bridge
