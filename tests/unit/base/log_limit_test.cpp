#include "core/base/log_limit.hpp"

#include <gtest/gtest.h>

#include "unit/base/at.hpp"

namespace connect_bridge {
namespace {

Now now_at(int ms) {
  return {test::at(ms), 0, 0};
}

TEST(LogLimit, TheFirstIsLoggedAtOnceThenOnePerPeriodWithTheirNumber) {
  LogLimit limit;
  EXPECT_EQ(limit.count(now_at(0)), 1U);
  EXPECT_EQ(limit.count(now_at(1)), std::nullopt);
  EXPECT_EQ(limit.count(now_at(9999)), std::nullopt);
  EXPECT_EQ(limit.count(now_at(10'000)), 3U);
  EXPECT_EQ(limit.count(now_at(19'999)), std::nullopt);
}

TEST(LogLimit, AfterAQuietTimeOneIsLoggedAtOnce) {
  LogLimit limit;
  EXPECT_EQ(limit.count(now_at(0)), 1U);
  EXPECT_EQ(limit.count(now_at(60'000)), 1U);
  EXPECT_EQ(limit.count(now_at(60'001)), std::nullopt);
}

TEST(LogLimit, SomeAreLoggedAtOnceThenOnePerPeriod) {
  LogLimit limit(30, std::chrono::seconds(5));
  for (int i = 0; i < 30; ++i) EXPECT_EQ(limit.count(now_at(0)), 1U) << i;
  EXPECT_EQ(limit.count(now_at(0)), std::nullopt);
  EXPECT_EQ(limit.count(now_at(4999)), std::nullopt);
  EXPECT_EQ(limit.count(now_at(5000)), 3U);
  EXPECT_EQ(limit.count(now_at(9999)), std::nullopt);
  EXPECT_EQ(limit.count(now_at(10'000)), 2U);
}

TEST(LogLimit, ALineSaysHowManyWereLeftOut) {
  EXPECT_EQ(left_out(1), "");
  EXPECT_EQ(left_out(3), "; 2 lines like this were left out");
}

}  // namespace
}  // namespace connect_bridge
