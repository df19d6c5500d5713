#include "net/url.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

Url good(std::string_view text) {
  const auto parsed = parse_url(text);
  EXPECT_TRUE(std::holds_alternative<Url>(parsed)) << text;
  return std::holds_alternative<Url>(parsed) ? std::get<Url>(parsed) : Url{};
}

TEST(Url, ReadsItsParts) {
  EXPECT_EQ(good("ws://robot"), (Url{false, "robot", 80, "/"}));
  EXPECT_EQ(good("WSS://Robot.Example"), (Url{true, "robot.example", 443, "/"}));
  EXPECT_EQ(good("ws://10.0.0.1:9090/a/b?c=d"), (Url{false, "10.0.0.1", 9090, "/a/b?c=d"}));
  EXPECT_EQ(good("wss://[2001:db8::1]:1/x"), (Url{true, "2001:db8::1", 1, "/x"}));
  EXPECT_EQ(good("ws://[fe80::1%eth0]"), (Url{false, "fe80::1%eth0", 80, "/"}));
  EXPECT_EQ(good("ws://robot?x#y"), (Url{false, "robot", 80, "/?x"}));
}

TEST(Url, WritesAuthorityAndTextWithoutSecrets) {
  EXPECT_EQ(good("ws://robot:80").authority(), "robot");
  EXPECT_EQ(good("wss://robot:80").authority(), "robot:80");
  EXPECT_EQ(good("wss://[::1]:443/x").authority(), "[::1]");
  EXPECT_EQ(good("wss://[::1]:9090/x?code=secret").text(), "wss://[::1]:9090/x");
}

TEST(Url, SaysWhatIsWrong) {
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
    const auto parsed = parse_url(text);
    ASSERT_TRUE(std::holds_alternative<std::string>(parsed)) << text;
    EXPECT_NE(std::get<std::string>(parsed).find("expected ws[s]://"), std::string::npos);
  }
}

}  // namespace
}  // namespace connect_bridge
