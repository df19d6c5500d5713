#include "net/tcp/route_watch.hpp"

#include <ifaddrs.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

#include "net/tcp/proxy_header.hpp"

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

// One change causes several messages: for a link, its addresses, its routes.
constexpr auto kSettling = 100ms;
constexpr auto kPeriod = 1s;

// An address with a zone ("fe80::1%eth0") belongs to its interface.
std::string without_zone(const std::string& address) {
  return address.substr(0, address.find('%'));
}

// The address as text; empty: neither IPv4 nor IPv6.
std::string text_of(const sockaddr* address) {
  const bool is_v6 = address->sa_family == AF_INET6;
  char text[NI_MAXHOST] = "";
  if (is_v6 || address->sa_family == AF_INET)
    ::getnameinfo(address, is_v6 ? sizeof(sockaddr_in6) : sizeof(sockaddr_in), text, sizeof text,
                  nullptr, 0, NI_NUMERICHOST);
  return without_zone(text);
}

}  // namespace

RouteWatch::RouteWatch(boost::asio::io_context& io, std::function<void()> changed)
    : netlink_(io), timer_(io), changed_(std::move(changed)) {}

std::string RouteWatch::open() {
  const int socket = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_ROUTE);
  sockaddr_nl groups{};
  groups.nl_family = AF_NETLINK;
  groups.nl_groups =
      RTMGRP_LINK | RTMGRP_IPV4_IFADDR | RTMGRP_IPV6_IFADDR | RTMGRP_IPV4_ROUTE | RTMGRP_IPV6_ROUTE;
  if (socket < 0 || bind(socket, reinterpret_cast<const sockaddr*>(&groups), sizeof groups) != 0) {
    std::string problem = std::strerror(errno);
    if (socket >= 0) ::close(socket);
    return problem;
  }
  netlink_.assign(socket);
  listen();
  return {};
}

void RouteWatch::listen() {
  netlink_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                      if_alive(this, &RouteWatch::on_readable));
}

// The content of the messages does not matter; a full buffer (ENOBUFS) means that there were many.
void RouteWatch::on_readable(ErrorCode error) {
  if (error) return;
  while (::recv(netlink_.native_handle(), buffer_.data(), buffer_.size(), 0) > 0) {
  }
  tell_soon();
  listen();
}

void RouteWatch::tell_soon() {
  if (will_tell_) return;
  will_tell_ = true;
  const auto allowed = reported_at_ + kPeriod - std::chrono::steady_clock::now();
  call_after(timer_, std::max<asio::steady_timer::duration>(kSettling, allowed),
             if_alive(this, &RouteWatch::tell));
}

void RouteWatch::tell() {
  will_tell_ = false;
  reported_at_ = std::chrono::steady_clock::now();
  changed_();
}

std::string lost_address(const TcpSocket& socket) {
  ErrorCode error;
  const auto local = plain_address(socket.local_endpoint(error).address());
  ifaddrs* all = nullptr;
  // No connection is closed if this cannot be found out.
  if (error || local.is_loopback() || getifaddrs(&all) != 0) return {};
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner(all, freeifaddrs);
  const std::string address = without_zone(local.to_string());
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next)
    if (one->ifa_addr != nullptr && text_of(one->ifa_addr) == address) return {};
  return local.to_string();
}

}  // namespace connect_bridge
