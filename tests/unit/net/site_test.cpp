#include "net/site.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

std::string site(const char* address) {
  return site_of(boost::asio::ip::make_address(address));
}

TEST(Site, IsTheNetworkOfAnAddress) {
  EXPECT_EQ(site("192.0.2.1"), site("192.0.2.254"));
  EXPECT_NE(site("192.0.2.1"), site("192.0.3.1"));
  EXPECT_EQ(site("2001:db8:0:1ff::1"), site("2001:db8:0:100::2"));
  EXPECT_NE(site("2001:db8:0:1ff::1"), site("2001:db8:0:200::1"));
  EXPECT_EQ(site("::ffff:192.0.2.1"), site("192.0.2.9"));
}

TEST(Site, TheLoopbackIsOne) {
  EXPECT_EQ(site("127.0.0.1"), site("::1"));
  EXPECT_EQ(site("127.0.0.1"), site("127.1.2.3"));
  EXPECT_NE(site("127.0.0.1"), site("192.0.2.1"));
}

}  // namespace
}  // namespace connect_bridge
