// The WebSocket type of src/net. Includes all of Boost.Beast: only accept.cpp, dial.cpp,
// network.cpp, socket.cpp and status_door.cpp may include this; everyone else declares
// `struct WebSocket`.
#pragma once

#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/core/stream_traits.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "net/tcp/transport.hpp"

namespace connect_bridge {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;

// In the headers "Server" and "User-Agent".
inline constexpr char kProgramName[] = "ROS2 Connect";

// Beast finds these two by argument-dependent lookup. Its own would wait here for the peer's end
// without a timeout; the connection does that itself, with one (Transport::finish).
inline void teardown(beast::role_type, Transport&, ErrorCode& error) {
  error = {};
}
template <class Handler>
void async_teardown(beast::role_type, Transport& transport, Handler&& handler) {
  asio::post(transport.get_executor(),
             beast::bind_front_handler(std::forward<Handler>(handler), ErrorCode{}));
}
inline void beast_close_socket(Transport& transport) {
  transport.abort();
}

// Without permessage-deflate: compressing secrets together with other data leaks them (CRIME), and
// our compression is per channel.
struct WebSocket : websocket::stream<Transport, false> {
  using websocket::stream<Transport, false>::stream;
};

// The subprotocol is one element of a comma-separated list.
bool names_subprotocol(beast::string_view list);

}  // namespace connect_bridge
