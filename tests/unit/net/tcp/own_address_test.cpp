#include "net/tcp/own_address.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include "unit/net/tcp/own_network.hpp"

namespace connect_bridge::test {
namespace {

// The kernel follows a carrier with a delay of up to a second.
std::string own_address_in_time(const std::string& expected) {
  for (int i = 0; i < 300 && own_address() != expected; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return own_address();
}

// None of these interfaces has a default route.
TEST(OwnAddress, IsOfAnInterfaceThatCarriesPackets) {
  bool made = true;
  const bool allowed = in_own_network([&made] {
    set_up("lo");
    EXPECT_EQ(own_address(), "127.0.0.1");
    const int idle = make_interface("idle");
    made = idle >= 0;
    if (!made) return;
    ::close(idle);
    give_address("idle", "172.17.0.1");
    set_up("idle");
    EXPECT_EQ(own_address_in_time("127.0.0.1"), "127.0.0.1") << "it has no carrier";
    const int used = make_interface("used");
    give_address("used", "10.0.0.1");
    EXPECT_EQ(own_address(), "127.0.0.1") << "it is down";
    set_up("used");
    EXPECT_EQ(own_address_in_time("10.0.0.1"), "10.0.0.1");
    ::close(used);
  });
  if (!allowed || !made) GTEST_SKIP() << "this machine allows no network interfaces of a test";
}

}  // namespace
}  // namespace connect_bridge::test
