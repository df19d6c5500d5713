#include "core/base/budget.hpp"

#include <gtest/gtest.h>

#include <memory>
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

// What the address sanitizer sees: a mirror outlives the link that fed it.
TEST(BudgetTest, AHoldThatWasReleasedOutlivesItsBudget) {
  auto budget = std::make_unique<Budget>(100);
  auto hold = budget->hold(10);
  hold.release();
  EXPECT_EQ(budget->used(), 0U);
  budget.reset();
  hold = {};
  EXPECT_EQ(hold.amount(), 0U);
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

TEST(Budget, WhatIsHeldIsHeldAbove) {
  Budget all(100);
  Budget one(&all);
  {
    auto hold = one.hold(30);
    EXPECT_EQ(all.used(), 30U);
    hold.resize(10);
    EXPECT_EQ(all.used(), 10U);
  }
  EXPECT_EQ(all.used(), 0U);
  EXPECT_EQ(Budget().room(), Budget::kNoLimit);
  EXPECT_EQ(Budget(nullptr).room(), Budget::kNoLimit);
}

// One holder that takes all that it may leaves as much to the others, and so does each of several.
TEST(Budget, NobodyTakesMoreThanItLeaves) {
  Budget all(120);
  Budget one(&all);
  Budget two(&all);
  auto greedy = one.hold(0);
  while (one.room() > 0) greedy.resize(greedy.amount() + 1);
  EXPECT_EQ(one.used(), 60U);
  auto late = two.hold(0);
  while (two.room() > 0) late.resize(late.amount() + 1);
  EXPECT_EQ(two.used(), 30U);
  EXPECT_EQ(one.room(), 0U);
  EXPECT_EQ(all.room(), 30U);
}

}  // namespace
}  // namespace connect_bridge
