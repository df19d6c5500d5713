#include "core/base/timers.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "unit/base/at.hpp"

namespace connect_bridge {
namespace {

using test::at;

std::string all_due(Timers<char>& timers, int ms) {
  std::string due;
  while (const auto one = timers.take_due(at(ms))) due += *one;
  return due;
}

TEST(TimersTest, GiveWhatIsDueInItsOrder) {
  Timers<char> timers;
  EXPECT_FALSE(timers.deadline());
  const auto c = timers.set(at(30), 'c');
  const auto a = timers.set(at(10), 'a');
  const auto b = timers.set(at(10), 'b');
  EXPECT_EQ(timers.deadline(), at(10));
  EXPECT_EQ(all_due(timers, 9), "");
  EXPECT_EQ(all_due(timers, 10), "ab");
  EXPECT_EQ(timers.deadline(), at(30));
  EXPECT_EQ(all_due(timers, 100), "c");
  EXPECT_FALSE(timers.deadline());
}

TEST(TimersTest, AreCancelledWithTheirHolder) {
  Timers<char> timers;
  {
    const auto gone = timers.set(at(10), 'x');
    EXPECT_TRUE(timers.deadline());
  }
  EXPECT_FALSE(timers.deadline());
  auto moved = timers.set(at(10), 'y');
  moved = timers.set(at(20), 'z');
  EXPECT_EQ(timers.deadline(), at(20));
  Timers<char>::Timer other = std::move(moved);
  EXPECT_TRUE(other);
  other.cancel();
  EXPECT_FALSE(other);
  EXPECT_EQ(all_due(timers, 100), "");
}

TEST(TimersTest, ATimerThatWasDueTakesNoOtherWithIt) {
  Timers<char> timers;
  auto first = timers.set(at(10), 'a');
  EXPECT_EQ(all_due(timers, 10), "a");
  const auto second = timers.set(at(10), 'b');
  first.cancel();
  EXPECT_EQ(timers.deadline(), at(10));
}

TEST(EarliestTest, IgnoresWhatIsNotSet) {
  EXPECT_EQ(earliest(std::nullopt, std::nullopt), std::nullopt);
  EXPECT_EQ(earliest(at(3), std::nullopt), at(3));
  EXPECT_EQ(earliest(std::nullopt, at(4)), at(4));
  EXPECT_EQ(earliest(at(3), at(4)), at(3));
}

}  // namespace
}  // namespace connect_bridge
