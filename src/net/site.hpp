// Where an address is, roughly.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <string>

namespace connect_bridge {

// The network of a house or an office: an IPv4 /24, an IPv6 /56; all loopback addresses are one.
// To be compared, not to be read.
[[nodiscard]] std::string site_of(const boost::asio::ip::address& address);

}  // namespace connect_bridge
