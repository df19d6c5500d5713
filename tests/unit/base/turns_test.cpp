#include "core/base/turns.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using Waiting = Turns<std::string, int>;

Waiting turns(std::size_t all = 100, std::size_t of_line = 100) {
  return Waiting({all, of_line});
}

// In the order of their turns.
std::string all_of(Waiting& waiting) {
  std::string text;
  while (const auto next = waiting.take()) text += std::to_string(*next) + " ";
  return text;
}

TEST(Turns, LinesTakeTurnsAndEachHasItsOrder) {
  auto waiting = turns();
  for (int i = 1; i <= 3; ++i) EXPECT_FALSE(waiting.add("a", i));
  EXPECT_FALSE(waiting.add("b", 11));
  EXPECT_FALSE(waiting.add("c", 21));
  EXPECT_EQ(waiting.size(), 5U);
  EXPECT_EQ(waiting.take(), 1);
  EXPECT_FALSE(waiting.add("b", 12));
  EXPECT_EQ(all_of(waiting), "11 21 2 12 3 ");
  EXPECT_TRUE(waiting.empty());
  EXPECT_FALSE(waiting.take());
}

// Whoever has many names does not get in front of one that waits.
TEST(Turns, LinesThatComeLaterWaitBehind) {
  auto waiting = turns();
  EXPECT_FALSE(waiting.add("m", 1));
  EXPECT_FALSE(waiting.add("z", 2));
  EXPECT_EQ(waiting.take(), 1);
  for (int i = 3; i <= 9; ++i) EXPECT_FALSE(waiting.add("n" + std::to_string(i), i));
  EXPECT_EQ(waiting.take(), 2);
}

TEST(Turns, OfAFullLineTheNewestFindsNoPlace) {
  auto waiting = turns(100, 2);
  EXPECT_FALSE(waiting.add("a", 1));
  EXPECT_FALSE(waiting.add("a", 2));
  EXPECT_EQ(waiting.add("a", 3), 3);
  EXPECT_FALSE(waiting.add("b", 11));
  EXPECT_EQ(all_of(waiting), "1 11 2 ");
}

TEST(Turns, WhereAllPlacesAreTakenTheNewestOfTheLongestLineGivesWay) {
  auto waiting = turns(4);
  EXPECT_FALSE(waiting.add("a", 1));
  for (int i = 11; i <= 13; ++i) EXPECT_FALSE(waiting.add("b", i));
  EXPECT_EQ(waiting.add("c", 21), 13);
  EXPECT_EQ(waiting.add("b", 14), 14);
  EXPECT_EQ(waiting.add("d", 31), 12);
  EXPECT_EQ(waiting.add("e", 41), 41) << "none has more than it";
  EXPECT_EQ(all_of(waiting), "1 11 21 31 ");
}

TEST(Turns, WithoutBoundsAllFindPlace) {
  Waiting waiting;
  for (int i = 0; i < 10'000; ++i) EXPECT_FALSE(waiting.add("a", i));
  EXPECT_EQ(waiting.size(), 10'000U);
}

TEST(Turns, WhatIsErasedWaitsNoLonger) {
  auto waiting = turns(4);
  for (int i = 1; i <= 4; ++i) EXPECT_FALSE(waiting.add(i < 3 ? "a" : "b", i));
  waiting.erase_if([](int i) { return i != 2; });
  EXPECT_EQ(waiting.size(), 1U);
  for (int i = 5; i <= 7; ++i) EXPECT_FALSE(waiting.add("b", i));
  EXPECT_EQ(all_of(waiting), "2 5 6 7 ");
  EXPECT_FALSE(waiting.add("a", 8));
  waiting.clear();
  EXPECT_TRUE(waiting.empty());
}

}  // namespace
}  // namespace connect_bridge
