// The address under which others may reach this machine.
#pragma once

#include <string>

namespace connect_bridge {

// The address by which other machines most likely reach this one, the first that exists of: IPv4 of
// the interface with the default route; IPv4 of the first interface that has a carrier and is no
// loopback; IPv6 of the interface with the default route; 127.0.0.1. Sends nothing. Behind a NAT or
// a proxy other machines connect to another address.
[[nodiscard]] std::string own_address();

}  // namespace connect_bridge
