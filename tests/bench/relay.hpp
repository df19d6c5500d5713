// The least that any bridge must do: a thread that takes and sends, a thread that receives and
// publishes, raw TCP with a 4-byte length in between, no queue, no rule, no loop. The rest of the
// cost is that of the machine.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <thread>

#include "ros_node.hpp"

namespace bench {

inline void require_socket(bool good, const char* what) {
  if (good) return;
  std::perror(what);
  std::exit(1);
}

inline bool write_all(int fd, const void* data, std::size_t size, int flags) {
  const auto* at = static_cast<const char*>(data);
  while (size > 0) {
    const auto n = ::send(fd, at, size, MSG_NOSIGNAL | flags);
    if (n <= 0) return false;
    at += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

inline bool read_all(int fd, void* data, std::size_t size) {
  auto* at = static_cast<char*>(data);
  while (size > 0) {
    const auto n = ::recv(fd, at, size, 0);
    if (n <= 0) return false;
    at += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

// port 0: listens on a free port and says which; else connects to it.
inline int open_relay(std::uint16_t port) {
  int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  if (port == 0) {
    socklen_t size = sizeof address;
    require_socket(::bind(fd, generic, size) == 0 && ::listen(fd, 1) == 0, "listen");
    require_socket(::getsockname(fd, generic, &size) == 0, "port");
    answer("{\"ready\":true,\"port\":" + std::to_string(ntohs(address.sin_port)) + "}");
    fd = ::accept4(fd, nullptr, nullptr, SOCK_CLOEXEC);
    require_socket(fd >= 0, "accept");
  } else {
    require_socket(::connect(fd, generic, sizeof address) == 0, "connect");
    answer("{\"ready\":true}");
  }
  const int on = 1;
  require_socket(::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on) == 0, "nodelay");
  return fd;
}

// Never destroys its entities: it ends with the process, when stdin closes.
inline void run_relay(Node& node, Commands& commands, const Options& options) {
  const int fd = open_relay(static_cast<std::uint16_t>(options.count("port", 0)));
  auto* out = new Publisher(node, options.text("give", "/bench/ping"));
  auto* in = new Subscription(node, options.text("take", "/bench/pong"));
  std::thread([fd, out] {
    Message message(kBodyBytesMin);
    for (std::uint32_t size = 0; read_all(fd, &size, sizeof size);) {
      if (rmw_serialized_message_resize(message.get(), size) != RMW_RET_OK) break;
      message.get()->buffer_length = size;
      if (!read_all(fd, message.get()->buffer, size)) break;
      out->send(message);
    }
  }).detach();
  std::thread([fd, in, &node] {
    WaitSet waiter(node, {in});
    Message message(kBodyBytesMin);
    for (bool open = true; open;) {
      if (!waiter.wait_until(now_ns() + 1'000'000'000LL)) continue;
      while (open && in->take(message)) {
        const auto size = static_cast<std::uint32_t>(message.get()->buffer_length);
        open = write_all(fd, &size, sizeof size, MSG_MORE) &&
               write_all(fd, message.get()->buffer, size, 0);
      }
    }
  }).detach();
  while (!commands.ended()) (void)commands.next(60'000);
  _exit(0);
}

}  // namespace bench
