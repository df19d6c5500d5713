#include "run/darkness.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

TEST(Darkness, RefusesNewLoginsAfterTenSecondsInARow) {
  Darkness darkness;
  for (int i = 1; i < Darkness::kCountMax; ++i) EXPECT_FALSE(darkness.count(true)) << i;
  EXPECT_FALSE(darkness.refuses_new());
  EXPECT_FALSE(darkness.count(false));
  for (int i = 1; i < Darkness::kCountMax; ++i) EXPECT_FALSE(darkness.count(true)) << i;
  const auto begun = darkness.count(true);
  ASSERT_TRUE(begun.has_value());
  EXPECT_EQ(begun->level, LogLevel::kError);
  EXPECT_TRUE(darkness.refuses_new());
  EXPECT_FALSE(darkness.count(true)) << "one line";
  const auto ended = darkness.count(false);
  ASSERT_TRUE(ended.has_value());
  EXPECT_EQ(ended->level, LogLevel::kInfo);
  EXPECT_FALSE(darkness.refuses_new());
}

}  // namespace
}  // namespace connect_bridge
