#include "core/base/budget.hpp"

#include <gtest/gtest.h>

#include <utility>

#include "core/base/pace.hpp"

namespace connect_bridge {
namespace {

TEST(BudgetTest, SharesAreGivenBackOnEveryPath) {
  Budget budget;
  {
    auto one = budget.hold(10);
    auto two = budget.hold(5);
    EXPECT_EQ(budget.used(), 15U);
    one = std::move(two);
    EXPECT_EQ(budget.used(), 5U);
    one.resize(7);
    EXPECT_EQ(budget.used(), 7U);
    one.release();
    EXPECT_EQ(budget.used(), 0U);
    one.resize(3);
    EXPECT_EQ(budget.used(), 3U);
  }
  EXPECT_EQ(budget.used(), 0U);
}

TEST(BudgetTest, AnEmptyHoldHasNoShare) {
  Budget::Hold none;
  none.resize(4);
  EXPECT_EQ(none.amount(), 0U);
}

TEST(PaceTest, LetsSomePassAtOnceAndThenOnePerPeriod) {
  Pace pace(3, std::chrono::seconds(1));
  const TimePoint now = TimePoint{} + std::chrono::hours(1);
  EXPECT_TRUE(pace.take(now));
  EXPECT_TRUE(pace.take(now));
  EXPECT_TRUE(pace.take(now));
  EXPECT_FALSE(pace.take(now));
  EXPECT_EQ(pace.free_at(), now + std::chrono::seconds(1));
  EXPECT_FALSE(pace.take(now + std::chrono::milliseconds(999)));
  EXPECT_TRUE(pace.take(now + std::chrono::seconds(1)));
  EXPECT_FALSE(pace.take(now + std::chrono::seconds(1)));
}

}  // namespace
}  // namespace connect_bridge
