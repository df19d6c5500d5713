#include "config/syntax.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using syntax::parse_url;

// "wss robot 443 /"; empty: no URL.
std::string parts(std::string_view text) {
  const auto dial = parse_url(text);
  if (!dial) return "";
  return (dial->tls ? "wss " : "ws ") + dial->host + " " + std::to_string(dial->port) + " " +
         dial->target;
}

TEST(ConfigSyntax, ReadsThePartsOfAUrl) {
  EXPECT_EQ(parts("ws://robot"), "ws robot 80 /");
  EXPECT_EQ(parts("WSS://Robot.Example"), "wss Robot.Example 443 /");
  EXPECT_EQ(parts("ws://10.0.0.1:9090/a/b?c=d"), "ws 10.0.0.1 9090 /a/b?c=d");
  EXPECT_EQ(parts("wss://[2001:db8::1]:1/x"), "wss 2001:db8::1 1 /x");
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
                           "ws://user:pw@robot",
                           "ws://ro bot",
                           "ws://robot/a b",
                           "ws:/robot",
                           "ws://robot\r\nX: y",
                           "ws://robot/\r\n"}) {
    EXPECT_FALSE(parse_url(text)) << text;
  }
}

}  // namespace
}  // namespace connect_bridge
