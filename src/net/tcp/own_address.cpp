#include "net/tcp/own_address.hpp"

#include <ifaddrs.h>
#include <net/if.h>

#include <boost/asio/ip/udp.hpp>
#include <memory>

#include "net/tcp/route.hpp"
#include "net/tcp/transport.hpp"

namespace connect_bridge {
namespace {

constexpr char kFarAwayIpv6[] = "2001:db8::1";  // address for documentation (RFC 3849)
constexpr std::uint16_t kAnyPort = 9;

// connect() on UDP only looks up the route and sends nothing.
std::string address_of_route_to(const char* far_away) {
  asio::io_context io;
  asio::ip::udp::socket socket(io);
  ErrorCode error;
  socket.connect({asio::ip::make_address(far_away), kAnyPort}, error);
  const auto local = error ? asio::ip::udp::endpoint{} : socket.local_endpoint(error);
  return error || local.address().is_unspecified() ? "" : local.address().to_string();
}

std::string address_of_first_interface() {
  ifaddrs* found = nullptr;
  if (::getifaddrs(&found) != 0) return {};
  const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> list(found, &::freeifaddrs);
  for (const ifaddrs* at = found; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr || at->ifa_addr->sa_family != AF_INET) continue;
    // An interface without a carrier, as the bridge of containers when none runs, brings nobody.
    constexpr unsigned int kCarries = IFF_UP | IFF_RUNNING;
    if ((at->ifa_flags & (IFF_LOOPBACK | kCarries)) != kCarries) continue;
    const auto* address = reinterpret_cast<const sockaddr_in*>(at->ifa_addr);
    return asio::ip::make_address_v4(ntohl(address->sin_addr.s_addr)).to_string();
  }
  return {};
}

}  // namespace

std::string own_address() {
  std::string address = address_of_route_to(kFarAway);
  if (address.empty()) address = address_of_first_interface();
  if (address.empty()) address = address_of_route_to(kFarAwayIpv6);
  return address.empty() ? "127.0.0.1" : address;
}

}  // namespace connect_bridge
