#include "net/url.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

TEST(Url, WritesAuthorityAndTextWithoutSecrets) {
  EXPECT_EQ((Url{false, "robot", 80, "/"}).authority(), "robot");
  EXPECT_EQ((Url{true, "robot", 80, "/"}).authority(), "robot:80");
  EXPECT_EQ((Url{true, "::1", 443, "/x"}).authority(), "[::1]");
  EXPECT_EQ((Url{true, "::1", 9090, "/x?code=secret"}).text(), "wss://[::1]:9090/x");
}

}  // namespace
}  // namespace connect_bridge
