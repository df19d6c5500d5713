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

TEST(LinePace, SomeLinesAreWrittenAtOnceThenOnePerPeriod) {
  LinePace lines;
  for (int i = 0; i < 30; ++i) EXPECT_EQ(lines.take(now_at(0)), "") << i;
  EXPECT_EQ(lines.take(now_at(0)), std::nullopt);
  EXPECT_EQ(lines.take(now_at(4999)), std::nullopt);
  EXPECT_EQ(lines.take(now_at(5000)), "; 2 lines like this were left out");
  EXPECT_EQ(lines.take(now_at(9999)), std::nullopt);
}

TEST(LinePace, WhatWasLeftOutIsToldOnce) {
  LinePace lines;
  for (int i = 0; i < 32; ++i) lines.take(now_at(0));
  EXPECT_EQ(lines.take(now_at(5000)), "; 2 lines like this were left out");
  EXPECT_EQ(lines.take(now_at(10'000)), "");
}

}  // namespace
}  // namespace connect_bridge
