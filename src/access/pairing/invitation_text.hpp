// Text of an invitation, for the person who starts the client or the robot.
#pragma once

#include <cstdint>
#include <string>

#include "config/invitation.hpp"

namespace connect_bridge {

// `port`: the port on which the server listens.
[[nodiscard]] std::string invitation_text(Invitation invitation, std::uint16_t port);

// The printed form of that text (secret_to_print()).
[[nodiscard]] std::string invitation_to_print(const Invitation& invitation, std::uint16_t port,
                                              bool terminal, const std::string& file,
                                              std::string& problem);

}  // namespace connect_bridge
