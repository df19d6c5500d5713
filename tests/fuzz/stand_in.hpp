// For fuzz targets with sockets: waiting without alarms, and a peer to dial on the loopback.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/base/check.hpp"

namespace connect_bridge {

// An input is a byte of flags and what is said: no more than a socket takes at once.
inline std::string_view words_of(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kWordsMax = 32768;
  return {reinterpret_cast<const char*>(data + 1), std::min(size - 1, kWordsMax)};
}

// While it lives, libFuzzer's alarm interrupts no system call of this thread.
class NoAlarm {
 public:
  NoAlarm() {
    sigset_t alarm;
    sigemptyset(&alarm);
    sigaddset(&alarm, SIGALRM);
    ::pthread_sigmask(SIG_BLOCK, &alarm, &before_);
  }
  ~NoAlarm() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  NoAlarm(const NoAlarm&) = delete;
  NoAlarm& operator=(const NoAlarm&) = delete;

 private:
  sigset_t before_;
};

class StandIn {
 public:
  StandIn() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const at = reinterpret_cast<sockaddr*>(&address);
    CONNECT_CHECK(::bind(listener_, at, size) == 0 && ::listen(listener_, 8) == 0);
    CONNECT_CHECK(::getsockname(listener_, at, &size) == 0);
    port_ = ntohs(address.sin_port);
    const timeval patience{5, 0};  // accept() too
    ::setsockopt(listener_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }

  [[nodiscard]] std::uint16_t port() const { return port_; }

  // The socket of the client that has dialed, or -1. It ends with a reset: ports in TIME-WAIT would
  // soon be all that there are.
  [[nodiscard]] int accepted() const {
    const int taken = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    const linger at_once{1, 0};
    if (taken >= 0) ::setsockopt(taken, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    return taken;
  }

 private:
  const int listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::uint16_t port_ = 0;
};

// What goes to a log in one line, whatever a peer has answered.
inline void check_loggable(std::string_view text) {
  constexpr std::size_t kTextMax = 2048;
  const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  CONNECT_CHECK(text.size() <= kTextMax && std::none_of(text.begin(), text.end(), control));
}

}  // namespace connect_bridge
