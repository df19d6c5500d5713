// Asks an HTTP proxy for a way to the server (CONNECT, RFC 9110 section 9.3.6).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/ports/url.hpp"
#include "net/transport.hpp"

namespace connect_bridge {

// On a connection to the proxy, before anything else; after it the bytes go to and come from the
// server. `done` is called once, with what is wrong (empty if nothing), and not from inside this
// call. There is no timeout: close the socket to cancel. An answer has 8 KiB of header at most.
void open_way(std::shared_ptr<TcpSocket> socket, const HttpProxy& proxy, const std::string& host,
              std::uint16_t port, std::function<void(std::string problem)> done);

}  // namespace connect_bridge
