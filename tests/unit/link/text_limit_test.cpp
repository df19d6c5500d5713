// Whose link ends when the links of an identity say too much.
#include "core/link/text_limit.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <utility>

#include "unit/base/at.hpp"

namespace connect_bridge {
namespace {

using test::at;

constexpr std::size_t kText = 100;  // bytes of each message

// Ten such messages a second.
struct Said {
  // How many of so many messages the link may send, until it or another one is to end.
  int say(std::uint64_t link, int messages, int ms = 0) {
    int heard = 0;
    while (heard < messages && !ended && limit.take({link}, kText, at(ms))) {
      ++heard;
      ended = limit.take_loudest();
    }
    return heard;
  }
  // The link that is to end for what others have said, or 0.
  std::uint64_t ends() { return std::exchange(ended, std::nullopt).value_or(LinkId{}).value; }

  TextLimit limit{1000};
  std::optional<LinkId> ended;
};
constexpr int kAll = 10'000;  // more than may pass

TEST(TextLimit, EightSecondsWorthPassesAtOnceAndThenItsRate) {
  Said s;
  EXPECT_NEAR(s.say(1, kAll), 80, 2);
  EXPECT_EQ(s.say(1, kAll), 0);
  EXPECT_NEAR(s.say(1, kAll, 5000), 50, 2);
}

TEST(TextLimit, WhoHasSaidMostEndsAndNotWhoSpeaksNext) {
  Said s;
  EXPECT_EQ(s.say(1, 25), 25);
  EXPECT_EQ(s.say(2, 50), 50);
  EXPECT_GT(s.say(3, kAll), 0);
  EXPECT_EQ(s.ends(), 2U);
  EXPECT_FALSE(s.limit.take_loudest());  // once
  EXPECT_GT(s.say(3, kAll), 0);
}

TEST(TextLimit, WhoHasSaidMostAndSpeaksNextEndsItself) {
  Said s;
  EXPECT_EQ(s.say(2, 10), 10);
  EXPECT_GT(s.say(1, kAll), 0);
  EXPECT_EQ(s.say(1, 1), 0);
  EXPECT_EQ(s.ends(), 0U);
  EXPECT_EQ(s.say(2, 1), 1);
  EXPECT_EQ(s.ends(), 1U);
}

// Or many links could make room for each other, each of which ends for little.
TEST(TextLimit, NobodyEndsForLessThanASecondsWorth) {
  Said s;
  std::uint64_t link = 1;
  while (link < 1000 && s.say(link, 5) == 5) ++link;
  EXPECT_NEAR(static_cast<double>(link), 16, 2);
  EXPECT_EQ(s.ends(), 0U);
  EXPECT_EQ(s.say(1000, 1), 0);
  EXPECT_EQ(s.ends(), 0U);
}

TEST(TextLimit, EachThatEndsMakesRoomForASecondsWorth) {
  Said s;
  EXPECT_GT(s.say(1, kAll), 0);
  EXPECT_EQ(s.say(2, kAll), 1);
  EXPECT_EQ(s.ends(), 1U);
  EXPECT_NEAR(s.say(2, kAll), 9, 1);
  EXPECT_EQ(s.ends(), 0U);
}

TEST(TextLimit, WhatALinkHasSaidCountsWhenItIsGone) {
  Said s;
  EXPECT_GT(s.say(1, kAll), 0);
  s.limit.forget({1});
  EXPECT_EQ(s.say(2, 1), 0);
  EXPECT_EQ(s.ends(), 0U);  // nobody is left who said it
  EXPECT_NEAR(s.say(2, kAll, 1000), 10, 2);
}

// A link that lives for long has said much in all.
TEST(TextLimit, WhatIsPaidOffIsHeldAgainstNobody) {
  Said s;
  EXPECT_EQ(s.say(1, 75), 75);
  EXPECT_EQ(s.say(1, 15, 100'000), 15);
  EXPECT_EQ(s.say(2, 50, 100'000), 50);
  EXPECT_GT(s.say(3, kAll, 100'000), 0);
  EXPECT_EQ(s.ends(), 2U);
}

}  // namespace
}  // namespace connect_bridge
