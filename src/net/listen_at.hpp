// Listening at one address, also at one that no interface has yet.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <string>

namespace connect_bridge {

struct ListenResult {
  std::string problem;  // empty: it listens
  std::string warning;  // for the log; empty: none
};

// Opens the acceptor at an IP address, or "localhost". The address of a VPN or a mobile network may
// come after this program has started: it is listened on all the same, with a warning, and clients
// connect as soon as an interface has it. A port that is in use is a problem. `port_key`: where the
// port is set.
[[nodiscard]] ListenResult listen_at(boost::asio::ip::tcp::acceptor& acceptor,
                                     const std::string& address, std::uint16_t port,
                                     const std::string& port_key);

}  // namespace connect_bridge
