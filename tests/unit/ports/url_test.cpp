#include "core/ports/url.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

TEST(Url, WritesAuthorityAndTextWithoutSecrets) {
  EXPECT_EQ((Url{false, "robot", 80, "/"}).authority(), "robot");
  EXPECT_EQ((Url{true, "robot", 80, "/"}).authority(), "robot:80");
  EXPECT_EQ((Url{true, "::1", 443, "/x"}).authority(), "[::1]");
  EXPECT_EQ((Url{true, "fe80::1%eth0", 9, "/x"}).authority(), "[fe80::1]:9") << "RFC 6874";
  EXPECT_EQ((Url{true, "fe80::1%eth0", 9, "/x"}).text("ws"), "wss://[fe80::1%eth0]:9/x");
  EXPECT_EQ((Url{true, "::1", 9090, "/x?code=secret"}).text("ws"), "wss://[::1]:9090/x");
  EXPECT_EQ((Url{false, "robot", 80, "/"}).text("http"), "http://robot/");
  EXPECT_EQ((Url{true, "robot", 443, "/?a"}).text("http"), "https://robot/");
}

TEST(Url, PortsFollowBracketsOfIpv6) {
  EXPECT_EQ(host_and_port("robot", 80), "robot:80");
  EXPECT_EQ(host_and_port("2001:db8::1", 3128), "[2001:db8::1]:3128");
  EXPECT_EQ(bracketed("192.0.2.1"), "192.0.2.1");
  EXPECT_EQ(bracketed("::1"), "[::1]");
}

TEST(Url, TheHostOfAnAddressIsWithoutThePort) {
  for (const char* host : {"192.0.2.1", "[2001:db8::1]", "robot"}) {
    EXPECT_EQ(host_of(host), host);
    EXPECT_EQ(host_of(std::string{host} + ":443"), host);
  }
  EXPECT_EQ(host_of(""), "");
}

}  // namespace
}  // namespace connect_bridge
