#include "net/listen_at.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <boost/asio/ip/v6_only.hpp>
#include <boost/system/error_code.hpp>

#include "core/ports/url.hpp"
#include "net/transport.hpp"

namespace connect_bridge {
namespace {

constexpr char kTaken[] = " (a server that runs already, or another program: end that, or change ";

using ListeningSocket = asio::ip::tcp::acceptor;
using ListenPoint = asio::ip::tcp::endpoint;

// The option of IPv4 counts for sockets of IPv6, too, and there on older kernels as well: their own
// one, IPV6_FREEBIND, came with Linux 4.15.
bool allow_absent_address(ListeningSocket& acceptor) {
  const int on = 1;
  return ::setsockopt(acceptor.native_handle(), IPPROTO_IP, IP_FREEBIND, &on, sizeof on) == 0;
}

// Whether it was bound to an address that is not there. It is tried without that first: only the
// kernel knows all addresses that it takes for its own, such as those of 127.0.0.0/8.
bool bind_to(ListeningSocket& acceptor, const ListenPoint& endpoint, ErrorCode& error) {
  acceptor.bind(endpoint, error);
  if (error != boost::system::errc::address_not_available || !allow_absent_address(acceptor))
    return false;
  acceptor.bind(endpoint, error);
  return !error;
}

}  // namespace

ListenResult listen_at(ListeningSocket& acceptor, const std::string& address, std::uint16_t port,
                       const std::string& port_key) {
  ErrorCode error;
  const auto parsed = asio::ip::make_address(address == "localhost" ? "127.0.0.1" : address, error);
  if (error) return {"cannot listen on '" + address + "': it is no IP address", {}};
  const ListenPoint endpoint{parsed, port};
  ErrorCode ignored;
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(ListeningSocket::reuse_address(true), error);
  if (!error && parsed.is_v6()) {
    acceptor.set_option(asio::ip::v6_only(!parsed.is_unspecified()), ignored);
  }
  const bool absent = !error && bind_to(acceptor, endpoint, error);
  if (!error) acceptor.listen(ListeningSocket::max_listen_connections, error);
  if (error) {
    const bool taken = error == asio::error::address_in_use;
    return {"cannot listen on " + host_and_port(parsed.to_string(), port) + ": " + error.message() +
                (taken ? kTaken + port_key + ")" : ""),
            {}};
  }
  if (!absent) return {};
  const std::string told =
      host_and_port(parsed.to_string(), acceptor.local_endpoint(ignored).port());
  return {{},
          "no interface has the address of " + told +
              " now: nobody can connect there before one has it (listen.address)"};
}

}  // namespace connect_bridge
