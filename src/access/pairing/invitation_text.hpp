// What a server that pairs says to the person who is to start the client, or the robot.
#pragma once

#include <cstdint>
#include <string>

#include "config/invitation.hpp"

namespace connect_bridge {

// `port`: where the server listens.
[[nodiscard]] std::string invitation_text(Invitation invitation, std::uint16_t port);

// What is printed of that text (secret_to_print()).
[[nodiscard]] std::string invitation_to_print(const Invitation& invitation, std::uint16_t port,
                                              bool terminal, const std::string& file,
                                              std::string& problem);

}  // namespace connect_bridge
