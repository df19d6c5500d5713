// What a rate refused and may leave later.
#include "core/flow/held_back.hpp"

#include <gtest/gtest.h>

#include <string>

#include "unit/base/at.hpp"

namespace connect_bridge {
namespace {

using test::at;
using HeldTexts = HeldBack<std::string, int>;

constexpr std::size_t kOfEntry = HeldTexts::kEntryBytes;

TEST(HeldBack, HoldsTheNewestOfEachPublisherUntilItsTime) {
  Budget memory(2000);
  Timers<int> timers;
  HeldTexts held(memory, {timers, 0});
  EXPECT_FALSE(timers.deadline());
  EXPECT_FALSE(held.hold({{1}, 0}, "old", 10, at(50)));
  EXPECT_FALSE(held.hold({{2}, 0}, "other", 10, at(60)));
  EXPECT_EQ(held.hold({{1}, 0}, "new", 20, at(70)), "old");
  EXPECT_EQ(memory.used(), 2 * kOfEntry + 30);
  EXPECT_EQ(timers.deadline(), at(60));
  EXPECT_FALSE(held.take_due(at(59)));
  EXPECT_EQ(held.take_due(at(100)), "other");
  EXPECT_EQ(held.take_due(at(100)), "new");
  EXPECT_FALSE(held.take_due(at(100)));
  EXPECT_TRUE(held.empty());
  EXPECT_EQ(memory.used(), 0U);
}

TEST(HeldBack, OneThatPassesEndsTheWait) {
  Budget memory(2000);
  Timers<int> timers;
  HeldTexts held(memory, {timers, 0});
  EXPECT_FALSE(held.take(OriginId{1}));
  EXPECT_FALSE(held.hold({{1}, 0}, "old", 10, at(50)));
  EXPECT_EQ(held.take(OriginId{1}), "old");
  EXPECT_FALSE(timers.deadline());
  EXPECT_EQ(memory.used(), 0U);
}

TEST(HeldBack, EachStateOfAPublisherIsHeld) {
  Budget memory(2000);
  Timers<int> timers;
  HeldTexts held(memory, {timers, 0});
  EXPECT_FALSE(held.hold({{1}, 5}, "arm", 10, at(50)));
  EXPECT_FALSE(held.hold({{1}, 6}, "cam", 10, at(60)));
  EXPECT_FALSE(held.hold({{2}, 5}, "other", 10, at(70)));
  EXPECT_EQ(held.take({OriginId{1}, 6}), "cam");
  EXPECT_EQ(held.take(OriginId{1}), "arm");
  EXPECT_FALSE(held.take(OriginId{1}));
  EXPECT_EQ(held.size(), 1U);
}

TEST(HeldBack, WithoutRoomNothingIsHeld) {
  Budget memory(kOfEntry + 15);
  Timers<int> timers;
  HeldTexts held(memory, {timers, 0});
  EXPECT_FALSE(held.hold({{1}, 0}, "a", 10, at(50)));
  EXPECT_EQ(held.hold({{2}, 0}, "b", 10, at(50)), "b");
  EXPECT_EQ(held.hold({{1}, 0}, "c", 10, at(50)), "c");
  EXPECT_EQ(held.size(), 1U);
  EXPECT_EQ(held.take(), "a");
  EXPECT_FALSE(held.take());
}

}  // namespace
}  // namespace connect_bridge
