#include "net/route.hpp"

#include <gtest/gtest.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>
#include <thread>

namespace connect_bridge {
namespace {

std::string to(const char* address) {
  return route_to(boost::asio::ip::make_address(address));
}

TEST(Route, ToThisMachineGoesByItsOwnInterface) {
  EXPECT_EQ(to("127.0.0.1"), "lo up from 7f000001");
  EXPECT_EQ(to("127.0.0.1"), to("127.0.0.1"));
}

void take_up_loopback() {
  const int any = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq request{};
  std::string("lo").copy(request.ifr_name, IFNAMSIZ);
  request.ifr_flags = IFF_UP | IFF_RUNNING;
  EXPECT_EQ(::ioctl(any, SIOCSIFFLAGS, &request), 0);
  ::close(any);
}

// In a network of its own, where at first there is no way to anywhere.
TEST(Route, IsAnotherOneWhenItsInterfaceComes) {
  bool allowed = true;
  std::thread([&] {
    allowed = ::unshare(CLONE_NEWNET) == 0;
    if (!allowed) return;
    EXPECT_EQ(to("127.0.0.1"), "");
    EXPECT_EQ(to("10.0.0.1"), "");
    EXPECT_EQ(to("2001:db8::1"), "");
    take_up_loopback();
    EXPECT_EQ(to("127.0.0.1"), "lo up from 7f000001");
    EXPECT_EQ(to("10.0.0.1"), "");
  }).join();
  if (!allowed) GTEST_SKIP() << "this machine does not allow network namespaces";
}

}  // namespace
}  // namespace connect_bridge
