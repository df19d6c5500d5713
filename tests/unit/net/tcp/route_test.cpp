#include "net/tcp/route.hpp"

#include <gtest/gtest.h>

#include <string>

#include "unit/net/tcp/own_network.hpp"

namespace connect_bridge::test {
namespace {

std::string to(const char* address) {
  return route_to(boost::asio::ip::make_address(address));
}

TEST(Route, ToThisMachineGoesByItsOwnInterface) {
  EXPECT_EQ(to("127.0.0.1"), "lo up from 7f000001");
  EXPECT_EQ(to("127.0.0.1"), to("127.0.0.1"));
}

// In a network of its own, where at first there is no way to anywhere.
TEST(Route, IsAnotherOneWhenItsInterfaceComes) {
  const bool allowed = in_own_network([] {
    EXPECT_EQ(to("127.0.0.1"), "");
    EXPECT_EQ(to("10.0.0.1"), "");
    EXPECT_EQ(to("2001:db8::1"), "");
    set_up("lo");
    EXPECT_EQ(to("127.0.0.1"), "lo up from 7f000001");
    EXPECT_EQ(to("10.0.0.1"), "");
  });
  if (!allowed) GTEST_SKIP() << "this machine does not allow network namespaces";
}

}  // namespace
}  // namespace connect_bridge::test
