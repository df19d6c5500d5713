// How a client shows a relay that it knows the robot.
#pragma once

#include <string>

namespace connect_bridge {

// A word that only who knows the robot's key can make (docs/protocol.md, "Relay"). The relay learns
// it from the robot, and from it nothing of the key. `pin`: of that key, in base64. Empty: OpenSSL
// cannot make it, or there is no pin.
[[nodiscard]] std::string client_word(const std::string& pin, const std::string& robot);

}  // namespace connect_bridge
