// A network of its own for a test, with interfaces that no other process sees.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <functional>
#include <string>
#include <thread>

namespace connect_bridge::test {

// Runs it in a thread that has one. Returns false, without running it, where that is not allowed.
[[nodiscard]] inline bool in_own_network(const std::function<void()>& run) {
  bool allowed = false;
  std::thread([&] {
    allowed = ::unshare(CLONE_NEWNET) == 0;
    if (allowed) run();
  }).join();
  return allowed;
}

inline ifreq request_for(const std::string& interface) {
  ifreq request{};
  interface.copy(request.ifr_name, IFNAMSIZ - 1);
  return request;
}

inline void change(unsigned long what, const ifreq& request) {
  const int any = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  EXPECT_EQ(::ioctl(any, what, &request), 0) << std::strerror(errno);
  ::close(any);
}

inline void set_up(const std::string& interface, bool up = true) {
  ifreq request = request_for(interface);
  if (up) request.ifr_flags = IFF_UP | IFF_RUNNING;
  change(SIOCSIFFLAGS, request);
}

// "lo:1" is a further address of "lo".
inline void give_address(const std::string& interface, const char* address) {
  ifreq request = request_for(interface);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  ::inet_pton(AF_INET, address, &to.sin_addr);
  std::memcpy(&request.ifr_addr, &to, sizeof to);
  change(SIOCSIFADDR, request);
}

// A new interface, which stays. It has a carrier while the file that is returned is open; -1: this
// machine makes none.
[[nodiscard]] inline int make_interface(const std::string& name) {
  const int file = ::open("/dev/net/tun", O_RDWR | O_CLOEXEC);
  ifreq request = request_for(name);
  request.ifr_flags = IFF_TUN | IFF_NO_PI;
  if (file < 0) return file;
  const bool made = ::ioctl(file, TUNSETIFF, &request) == 0 && ::ioctl(file, TUNSETPERSIST, 1) == 0;
  if (made) return file;
  ::close(file);
  return -1;
}

}  // namespace connect_bridge::test
