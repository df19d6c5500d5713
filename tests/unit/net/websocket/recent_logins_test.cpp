#include "net/websocket/recent_logins.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

TEST(RecentLogins, AreForgottenAfterAnHour) {
  RecentLogins logins;
  const TimePoint begin{1h};
  logins.add("203.0.113.5", begin);
  EXPECT_TRUE(logins.has("203.0.113.5", begin + 59min));
  EXPECT_FALSE(logins.has("203.0.113.5", begin + 60min));
  EXPECT_FALSE(logins.has("203.0.113.6", begin));
  logins.add("", begin);
  EXPECT_FALSE(logins.has("", begin));
}

TEST(RecentLogins, TheOldestGoesWhenThereAreTooMany) {
  RecentLogins logins;
  TimePoint now{1h};
  for (std::size_t i = 0; i <= RecentLogins::kAddressesMax; ++i)
    logins.add(std::to_string(i), now += 1ns);
  EXPECT_FALSE(logins.has("0", now));
  EXPECT_TRUE(logins.has("1", now));
  EXPECT_TRUE(logins.has(std::to_string(RecentLogins::kAddressesMax), now));
}

}  // namespace
}  // namespace connect_bridge
