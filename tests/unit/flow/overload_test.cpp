#include "core/flow/overload.hpp"

#include <gtest/gtest.h>

#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

// Time in milliseconds.
struct Judge {
  void came(std::int64_t oldest, std::int64_t at) { subject.came(time(oldest), time(at)); }
  void began(std::int64_t since, std::int64_t at) { subject.began(time(since), time(at)); }
  static TimePoint time(std::int64_t ms) { return TimePoint{} + std::chrono::milliseconds(ms); }

  Overload subject;
};

// More came than left, and each waited for more than 50 ms, for 100 ms.
Judge overloaded() {
  Judge s;
  s.came(0, 60);
  s.came(0, 150);
  EXPECT_TRUE(s.subject.stands());
  return s;
}

TEST(Overload, IsTooLongAWaitForAWholeInterval) {
  Judge s;
  s.came(0, 50);
  s.came(0, 60);  // too long since 50
  s.came(0, 149);
  EXPECT_FALSE(s.subject.stands());
  s.came(0, 150);
  EXPECT_TRUE(s.subject.stands());
}

TEST(Overload, ABurstThatHasLeftIsNone) {
  Judge s;
  s.came(0, 60);
  s.began(60, 110);  // it waited for 50 ms: the time begins anew
  s.came(110, 170);
  s.came(110, 250);
  EXPECT_FALSE(s.subject.stands());
}

TEST(Overload, WhereAsMuchLeavesAsComesThereIsNone) {
  Judge s;
  s.came(0, 60);
  s.began(0, 70);
  s.began(0, 140);
  s.came(60, 150);
  EXPECT_FALSE(s.subject.stands());
  s.came(60, 151);
  EXPECT_TRUE(s.subject.stands());
}

TEST(Overload, IsOverWhenForAnIntervalNothingHasWaitedLong) {
  Judge s = overloaded();
  s.began(150, 200);
  s.began(249, 299);
  EXPECT_TRUE(s.subject.stands());
  s.began(250, 300);
  EXPECT_FALSE(s.subject.stands());
}

TEST(Overload, GoesOnWhileMessagesAreReplacedOrWaitLong) {
  Judge s = overloaded();
  s.began(150, 200);
  s.subject.replaced();
  s.began(250, 300);
  EXPECT_TRUE(s.subject.stands());
  s.began(300, 351);  // 51 ms
  s.began(380, 400);
  EXPECT_TRUE(s.subject.stands());
  s.began(480, 500);
  EXPECT_FALSE(s.subject.stands());
}

TEST(Overload, IsOverAtOnceWhenNothingWaits) {
  Judge s = overloaded();
  s.subject.over();
  EXPECT_FALSE(s.subject.stands());
  s.came(160, 300);
  EXPECT_FALSE(s.subject.stands());
}

// A message that takes 400 ms to leave makes the next one wait.
TEST(Overload, LargeMessagesHaveMoreTime) {
  Judge s;
  for (int i = 0; i < 2; ++i) s.subject.sent(std::chrono::milliseconds(400), 1000);
  s.came(0, 250);
  s.came(0, 251);
  s.came(0, 1049);
  EXPECT_FALSE(s.subject.stands());
  s.came(0, 1050);
  EXPECT_TRUE(s.subject.stands());
}

// The first may have left while the path's rate was not yet known.
TEST(Overload, TheQuickerOfTwoMessagesTellsTheRate) {
  Overload subject;
  const auto send = [&](std::int64_t took_ms, std::uint64_t bytes) {
    subject.sent(std::chrono::milliseconds(took_ms), bytes);
    return subject.rate();
  };
  EXPECT_EQ(send(500, 100'000), 0);
  EXPECT_EQ(send(100, 100'000), 1e6);
  EXPECT_EQ(send(200, 100'000), 1e6);
  EXPECT_EQ(send(200, 100'000), 0.5e6);
  EXPECT_EQ(send(19, 100'000), 0);  // it was there at once
  EXPECT_EQ(send(200, 100'000), 0);
  EXPECT_EQ(send(2000, 100'000), 0.5e6);
  EXPECT_EQ(Overload{subject}.rate(), 0.5e6);
}

TEST(Overload, AMessageOfASecondTellsTheRateByItself) {
  Overload subject;
  subject.sent(std::chrono::seconds(2), 100'000);
  EXPECT_EQ(subject.rate(), 50'000);
}

// A break of a path that carries all is no reason to send less.
TEST(Overload, ASlowMessageAfterAQuickOneTellsNoRate) {
  Overload subject;
  const auto send = [&](std::int64_t took_ms) {
    subject.sent(std::chrono::milliseconds(took_ms), 100'000);
    return subject.rate();
  };
  EXPECT_EQ(send(10), 0);
  EXPECT_EQ(send(1500), 0);
  EXPECT_EQ(send(10), 0);
  EXPECT_EQ(send(2000), 0);
  EXPECT_EQ(send(2000), 50'000);
}

// The path stood still while it was under way.
TEST(Overload, OneThatTookLongAloneIsNoMeasure) {
  Judge s;
  s.subject.sent(std::chrono::milliseconds(4), 1000);
  s.subject.sent(std::chrono::milliseconds(4000), 1000);
  s.came(0, 60);
  s.came(0, 152);
  EXPECT_TRUE(s.subject.stands());
}

}  // namespace
}  // namespace connect_bridge::flow_test
