// The address under which others may reach this machine.
#pragma once

#include <string>

namespace connect_bridge {

// The address by which other machines most likely reach this one: that of the interface with the
// default route, of IPv4 or else of IPv6; without one, the IPv4 address of the first interface that
// has a carrier and is no loopback; else 127.0.0.1. Sends nothing. Behind a NAT or a proxy others
// dial another address.
[[nodiscard]] std::string own_address();

}  // namespace connect_bridge
