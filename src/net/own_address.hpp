// The address under which others may reach this machine.
#pragma once

#include <string>

namespace connect_bridge {

// That of the interface with the default route; without one, of the first interface that is no
// loopback; where there is no IPv4, that of the default route of IPv6; else 127.0.0.1. Sends
// nothing. Behind a NAT or a proxy others dial another address.
[[nodiscard]] std::string own_address();

}  // namespace connect_bridge
