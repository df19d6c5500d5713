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
  std::size_t left = 5;
  EXPECT_FALSE(held.take_due(at(59), left));
  EXPECT_EQ(held.take_due(at(100), left), "other");
  EXPECT_EQ(held.take_due(at(100), left), "new");
  EXPECT_FALSE(held.take_due(at(100), left));
  EXPECT_EQ(left, 3U);
  EXPECT_TRUE(held.empty());
  EXPECT_EQ(memory.used(), 0U);
}

// They leave in the order of their times. A step without room for more wakes the owner again,
// behind the others that are due.
TEST(HeldBack, OnlySoManyLeaveInAStep) {
  Budget memory(1 << 20);
  Timers<int> timers;
  HeldTexts first(memory, {timers, 1});
  HeldTexts second(memory, {timers, 2});
  for (std::uint64_t state = 1; state <= 4; ++state)
    EXPECT_FALSE(first.hold({{1}, state}, std::to_string(state), 10, at(60 - state)));
  EXPECT_FALSE(second.hold({{1}, 1}, "other", 10, at(90)));
  EXPECT_EQ(timers.deadline(), at(56));
  std::size_t left = 3;
  EXPECT_EQ(timers.take_due(at(100)), 1);
  for (const char* text : {"4", "3", "2"}) EXPECT_EQ(first.take_due(at(100), left), text);
  EXPECT_FALSE(first.take_due(at(100), left));
  EXPECT_EQ(timers.take_due(at(100)), 2);
  EXPECT_EQ(timers.take_due(at(100)), 1);
  left = 3;
  EXPECT_EQ(first.take_due(at(100), left), "1");
  EXPECT_FALSE(timers.take_due(at(100)));
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
