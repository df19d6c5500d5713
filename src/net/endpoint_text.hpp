// Addresses and ports in logs and status pages.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <cstdint>
#include <string>

namespace connect_bridge {

// "192.0.2.1", "[2001:db8::1]"
[[nodiscard]] inline std::string host_text(const boost::asio::ip::address& address) {
  return address.is_v6() ? "[" + address.to_string() + "]" : address.to_string();
}

// "192.0.2.1:9090"
[[nodiscard]] inline std::string endpoint_text(const boost::asio::ip::address& address,
                                               std::uint16_t port) {
  return host_text(address) + ":" + std::to_string(port);
}

}  // namespace connect_bridge
