#include "net/route_watch.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

// One change is several messages: a link, its addresses, its routes.
constexpr auto kSettling = 100ms;
constexpr auto kPeriod = 1s;

std::string text_of(const sockaddr* address) {
  char text[INET6_ADDRSTRLEN] = "";
  if (address->sa_family == AF_INET) {
    sockaddr_in in{};
    std::memcpy(&in, address, sizeof in);
    inet_ntop(AF_INET, &in.sin_addr, text, sizeof text);
  } else if (address->sa_family == AF_INET6) {
    sockaddr_in6 in{};
    std::memcpy(&in, address, sizeof in);
    inet_ntop(AF_INET6, &in.sin6_addr, text, sizeof text);
  }
  return text;
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
                      [weak = weak_from_this()](const boost::system::error_code& error) {
                        const auto self = weak.lock();
                        if (self && !error) self->on_readable();
                      });
}

// The content of the messages does not matter; a full buffer (ENOBUFS) means that there were many.
void RouteWatch::on_readable() {
  while (::recv(netlink_.native_handle(), buffer_.data(), buffer_.size(), 0) > 0) {
  }
  tell_soon();
  listen();
}

void RouteWatch::tell_soon() {
  if (will_tell_) return;
  will_tell_ = true;
  const auto now = std::chrono::steady_clock::now();
  timer_.expires_at(std::max(now + kSettling, told_at_ + kPeriod));
  timer_.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
    const auto self = weak.lock();
    if (!self || error) return;
    self->will_tell_ = false;
    self->told_at_ = std::chrono::steady_clock::now();
    self->changed_();
  });
}

bool is_own_address(const std::string& address) {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return true;  // not known: no connection is closed for that
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner(all, freeifaddrs);
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr != nullptr && text_of(one->ifa_addr) == address) return true;
  }
  return false;
}

}  // namespace connect_bridge
