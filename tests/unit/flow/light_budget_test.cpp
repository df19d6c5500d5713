// How much small messages may overtake others.
#include "core/flow/light_budget.hpp"

#include <gtest/gtest.h>

#include "unit/base/at.hpp"

namespace connect_bridge {
namespace {

using test::at;

constexpr double kPathRate = 1e6;  // bytes per second, of which light messages have a tenth

TEST(LightBudget, TheyHaveATenthOfThePath) {
  LightBudget budget;
  EXPECT_TRUE(budget.ready(at(0)));
  budget.take(10'000, kPathRate, 0, at(0));  // a tenth of a second's worth, half of it in advance
  EXPECT_FALSE(budget.ready(at(49)));
  EXPECT_TRUE(budget.ready(at(50)));
}

TEST(LightBudget, AFewComeAtOnce) {
  LightBudget budget;
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(budget.ready(at(1000))) << i;
    budget.take(500, kPathRate, 0, at(1000));
  }
  budget.take(500, kPathRate, 0, at(1000));
  EXPECT_FALSE(budget.ready(at(1000)));
}

// Or a heartbeat would wait behind a picture on the slowest of paths.
TEST(LightBudget, APathThatIsSlowOrNotKnownLetsTenKilobytesASecondPass) {
  for (const double rate : {0.0, 10'000.0}) {
    LightBudget budget;
    budget.take(1000, rate, 0, at(0));
    EXPECT_FALSE(budget.ready(at(49)));
    EXPECT_TRUE(budget.ready(at(50)));
  }
}

TEST(LightBudget, WhereTheLinksRateIsLimitedTheyHaveNoMoreThanHalfOfThat) {
  LightBudget wide;
  wide.take(10'000, kPathRate, 1e6, at(0));  // as without a limit
  EXPECT_FALSE(wide.ready(at(49)));
  EXPECT_TRUE(wide.ready(at(50)));
  LightBudget narrow;
  narrow.take(100, kPathRate, 1000, at(0));  // 200 ms at 500 bytes a second
  EXPECT_FALSE(narrow.ready(at(149)));
  EXPECT_TRUE(narrow.ready(at(150)));
}

}  // namespace
}  // namespace connect_bridge
