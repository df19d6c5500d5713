// What a server that pairs says to the person who is to start the client, or the robot.
#pragma once

#include <cstdint>
#include <string>

#include "config/invitation.hpp"

namespace connect_bridge {

// `port`: where the server listens.
[[nodiscard]] std::string invitation_text(Invitation invitation, std::uint16_t port);

// What is printed: that text on a terminal; else, since others may read that output (a journal, the
// log of a container), the name of the file that then has the text, for its owner alone. `problem`
// is set if it cannot be written. Blocks as the disk does.
[[nodiscard]] std::string invitation_to_print(const Invitation& invitation, std::uint16_t port,
                                              bool terminal, const std::string& file,
                                              std::string& problem);

}  // namespace connect_bridge
