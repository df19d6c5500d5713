#include "net/tcp/repair_watch.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

TEST(RepairWatch, AsksAgainAfterAWhile) {
  RepairWatch watch;
  EXPECT_TRUE(watch.is_due(TimePoint{1s}));
  watch.note({}, TimePoint{1s});
  EXPECT_FALSE(watch.is_due(TimePoint{1s} + RepairWatch::kPeriod / 2));
  EXPECT_TRUE(watch.is_due(TimePoint{1s} + RepairWatch::kPeriod));
}

TEST(RepairWatch, TellsOfLossesOnTheWayToThePeer) {
  RepairWatch watch;
  watch.note({.repairs = {true, 3000, 7}}, TimePoint{1s});
  EXPECT_TRUE(watch.repairs().open);
  EXPECT_EQ(watch.repairs().under_way_bytes, 3000U);
  EXPECT_EQ(watch.repairs().repeated, 7U);
  watch.note({.repairs = {false, 0, 7}}, TimePoint{2s});
  EXPECT_FALSE(watch.repairs().open);
}

TEST(RepairWatch, TellsOfTheOtherWayUntilSomethingIsRead) {
  RepairWatch watch;
  watch.note({.too_early = 1}, TimePoint{1s});
  EXPECT_TRUE(watch.misses());
  EXPECT_TRUE(watch.repairs().open);
  watch.note({.too_early = 3}, TimePoint{2s});
  EXPECT_TRUE(watch.repairs().open);
  watch.has_read({.too_early = 4});
  EXPECT_FALSE(watch.repairs().open);
  watch.note({.too_early = 5}, TimePoint{3s});
  EXPECT_TRUE(watch.repairs().open);
}

}  // namespace
}  // namespace connect_bridge
