#include "net/site.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

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

TEST(Site, APrivateBlockIsOne) {
  EXPECT_EQ(site("10.1.2.3"), site("10.200.0.1"));
  EXPECT_EQ(site("172.16.0.1"), site("172.31.255.1"));
  EXPECT_EQ(site("192.168.0.1"), site("192.168.178.20"));
  EXPECT_EQ(site("169.254.1.1"), site("169.254.9.9"));
  EXPECT_EQ(site("fd00:1::1"), site("fc00:2:3::1"));
  EXPECT_EQ(site("fe80::1"), site("fe80:0:0:1::2"));
  EXPECT_EQ(site("::ffff:192.168.1.1"), site("192.168.2.1"));
  const std::set<std::string> blocks{site("10.1.2.3"),    site("172.16.0.1"), site("192.168.0.1"),
                                     site("169.254.1.1"), site("fd00::1"),    site("fe80::1")};
  EXPECT_EQ(blocks.size(), 6U);
  EXPECT_NE(site("172.32.0.1"), site("172.33.0.1"));
}

TEST(Site, BeginsWithItsFamily) {
  EXPECT_EQ(site("192.0.2.1").front(), '4');
  EXPECT_EQ(site("10.0.0.1").front(), '4');
  EXPECT_EQ(site("2001:db8::1").front(), '6');
  EXPECT_EQ(site("fd00::1").front(), '6');
  EXPECT_NE(site("::1").front(), '6');
}

}  // namespace
}  // namespace connect_bridge
