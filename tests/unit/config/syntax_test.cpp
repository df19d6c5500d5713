#include "config/syntax.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using syntax::parse_url;

// "wss robot 443 /"; empty: no URL.
std::string parts(std::string_view text) {
  const auto url = parse_url(text);
  if (!url) return "";
  return (url->secure ? "wss " : "ws ") + url->host + " " + std::to_string(url->port) + " " +
         url->target;
}

TEST(ConfigSyntax, ReadsThePartsOfAUrl) {
  EXPECT_EQ(parts("ws://robot"), "ws robot 80 /");
  EXPECT_EQ(parts("WSS://Robot.Example"), "wss Robot.Example 443 /");
  EXPECT_EQ(parts("ws://10.0.0.1:9090/a/b?c=d"), "ws 10.0.0.1 9090 /a/b?c=d");
  EXPECT_EQ(parts("wss://[2001:db8::1]:1/x"), "wss 2001:db8::1 1 /x");
  EXPECT_EQ(parts("ws://[fe80::1%eth0]:9090/"), "ws fe80::1%eth0 9090 /");
  EXPECT_EQ(parts("ws://[fe80::1%25eth0]"), "ws fe80::1%eth0 80 /");
}

TEST(ConfigSyntax, RefusesWhatIsNoUrl) {
  for (const char* text : {"",
                           "robot",
                           "robot:9090",
                           "http://robot",
                           "ws://",
                           "ws://:9090",
                           "ws://robot:",
                           "ws://robot:0",
                           "ws://robot:65536",
                           "ws://robot:9x",
                           "ws://robot:-1",
                           "ws://::1",
                           "ws://[::1",
                           "ws://[::1]9",
                           "ws://[robot]",
                           "ws://[]",
                           "ws://[fe80::1%]",
                           "ws://[fe80::1%et h]",
                           "ws://[fe80::1%an-interface-of-long-name]",
                           "ws://[2001:db8::1%eth0]",
                           "ws://fe80::1%eth0",
                           "ws://user:pw@robot",
                           "ws://ro bot",
                           "ws://robot/a b",
                           "ws:/robot",
                           "ws://robot\r\nX: y",
                           "ws://robot/\r\n"}) {
    EXPECT_FALSE(parse_url(text)) << text;
  }
}

TEST(ConfigSyntax, KnowsAddresses) {
  using namespace std::string_view_literals;
  for (const auto text : {"127.0.0.1", "0.0.0.0", "::", "::1", "FE80::1",
                          "1:2:3:4:5:6:7::", "1:2:3:4:5:6:7:8", "::ffff:10.0.0.1"}) {
    EXPECT_TRUE(syntax::is_ip_address(text)) << text;
  }
  for (const auto text : {""sv, "1.2.3"sv, "1.2.3.4.5"sv, "01.2.3.4"sv, "1.2.3.4 "sv, "0x1.2.3.4"sv,
                          ":"sv, ":::"sv, "1::2::3"sv, "fe80::1%eth0"sv, "::1.2.3.04"sv,
                          "1:2:3:4:5:6:7:8:9"sv, "127.0.0.1\0x"sv, "::1\0x"sv}) {
    EXPECT_FALSE(syntax::is_ip_address(text)) << text;
  }
}

TEST(ConfigSyntax, KnowsThisMachine) {
  for (const auto* text : {"localhost", "127.0.0.1", "127.255.0.9", "::1", "0:0:0:0:0:0:0:1"})
    EXPECT_TRUE(syntax::is_loopback(text)) << text;
  for (const auto* text : {"", "126.0.0.1", "128.0.0.1", "0.0.0.0", "::", "::2", "fe80::1",
                           "::ffff:127.0.0.1", "localhost.example"})
    EXPECT_FALSE(syntax::is_loopback(text)) << text;
}

}  // namespace
}  // namespace connect_bridge
