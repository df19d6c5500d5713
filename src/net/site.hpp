// Where an address is, roughly.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <string>

namespace connect_bridge {

// The network of a house or an office: an IPv4 /24, an IPv6 /56; each block of private addresses is
// one, and so are all loopback addresses. To be compared, not to be read, but for the first
// character: '4' or '6' of an IPv4 or IPv6 network, which may be one (core/side/neighbours.cpp).
[[nodiscard]] std::string site_of(const boost::asio::ip::address& address);

}  // namespace connect_bridge
