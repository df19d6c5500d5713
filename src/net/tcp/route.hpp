// The route of packets to another machine, as far as this one knows it.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <string>

namespace connect_bridge {

// An address for documentation (RFC 5737), so nobody has it: packets there take the default route.
inline constexpr char kFarAway[] = "192.0.2.1";

// The kernel's route for `to` now (rtnetlink(7), RTM_GETROUTE): the interface, whether it is up and
// has a carrier, the gateway and the own address. The texts are equal if and only if these are.
// Empty: not known. Does not wait for the network. Any thread.
[[nodiscard]] std::string route_to(const boost::asio::ip::address& to);

}  // namespace connect_bridge
