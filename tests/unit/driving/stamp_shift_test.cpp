#include "core/driving/stamp_shift.hpp"

#include <gtest/gtest.h>

#include "unit/driving/samples.hpp"

namespace connect_bridge::driving {
namespace {

using driving_test::bytes_of;
using driving_test::twist;
using driving_test::twist_stamped;
using std::chrono::milliseconds;
using std::chrono::seconds;
using Verdict = AgeJudge::Verdict;

constexpr Stamp kNow = 1'700'000'000'000'000'000;

Stamp ms(std::int64_t n) {
  return n * 1'000'000;
}

// The stamp that a command gets which was stamped and published this long before now, by a clock
// that is ahead by `offset` ms; in ms after now.
std::int64_t stamp_after(std::int64_t offset, std::int64_t age = 20, std::int64_t bound = 5,
                         std::int64_t stamped = 0) {
  const Stamp published = kNow + ms(offset) - ms(age);
  const Payload sample = twist_stamped(published + ms(stamped), 1);
  const auto changed =
      shifted(read_command(CommandType::kTwistStamped, sample.view()), sample.view(),
              {{milliseconds(offset), milliseconds(bound), 1}, published}, kNow);
  const Payload& out = changed ? *changed : sample;
  const Command command = read_command(CommandType::kTwistStamped, out.view());
  EXPECT_TRUE(command.readable && command.moves);
  return (*stamp_of(out.view(), command.stamp) - kNow) / ms(1);
}

TEST(StampShift, AStampIsInTheRobotsClock) {
  EXPECT_EQ(stamp_after(5000), -20);
  EXPECT_EQ(stamp_after(-5000), -20);
  EXPECT_EQ(stamp_after(51), -20);
  EXPECT_EQ(stamp_after(-3'600'000), -20);
}

TEST(StampShift, ClocksThatAgreeChangeNoByte) {
  EXPECT_EQ(stamp_after(50, 20), 30);
  EXPECT_EQ(stamp_after(-50, 20), -70);
  // The offset is known less exactly than that.
  EXPECT_EQ(stamp_after(90, 20, 100), 70);
  EXPECT_EQ(stamp_after(101, 20, 100), -20);
}

TEST(StampShift, NoStampIsOfTheFuture) {
  EXPECT_EQ(stamp_after(5000, 20, 5, 300), 0);
  // The machine of the publisher is ahead of its bridge.
  EXPECT_EQ(stamp_after(0, -5000), 0);
  EXPECT_EQ(stamp_after(0, -40), 40);
}

TEST(StampShift, OtherMeaningsStay) {
  EXPECT_EQ(stamp_after(5000, 20, 5, 10'001), 14'981);
  EXPECT_EQ(stamp_after(5000, 20, 5, -10'001), -5021);
}

TEST(StampShift, ZeroStaysZeroAndUnknownStaysItself) {
  const auto change = [](const Payload& sample, CommandType type, Stamp published) {
    return shifted(read_command(type, sample.view()), sample.view(),
                   {{seconds(5), milliseconds(1), 1}, published}, kNow);
  };
  EXPECT_FALSE(change(twist_stamped(0, 1), CommandType::kTwistStamped, kNow));
  EXPECT_FALSE(change(twist_stamped(kNow, 1), CommandType::kTwistStamped, 0));
  EXPECT_FALSE(change(twist(1), CommandType::kTwist, kNow));
}

// ---- age

PeerClock clock_after(std::uint64_t replies) {
  return {seconds(1), milliseconds(10), replies};
}

struct Judged {
  Verdict at(std::int64_t age_ms, std::uint64_t replies = 1) {
    return judge.judge(milliseconds(age_ms), milliseconds(300), clock_after(replies));
  }
  AgeJudge judge;
};

TEST(AgeJudge, TheLimitHolds) {
  Judged j;
  EXPECT_EQ(j.at(300), Verdict::kFresh);
  EXPECT_EQ(j.at(301), Verdict::kOld);
  EXPECT_EQ(j.at(301, 9), Verdict::kOld);
  EXPECT_EQ(j.at(-60), Verdict::kFresh);
}

TEST(AgeJudge, AYoungCommandWaitsForAReplyAndThenCountsFromTheYoungest) {
  Judged j;
  EXPECT_EQ(j.at(-5000, 7), Verdict::kOld);
  EXPECT_EQ(j.at(-5000, 7), Verdict::kOld);
  EXPECT_EQ(j.at(-5000, 8), Verdict::kFreshAhead);
  EXPECT_EQ(j.judge.corrected(milliseconds(-4900)), milliseconds(100));
  EXPECT_EQ(j.at(-4701, 8), Verdict::kFresh);
  EXPECT_EQ(j.at(-4699, 8), Verdict::kOld);
  EXPECT_EQ(j.at(-5020, 8), Verdict::kFresh);
  EXPECT_EQ(j.at(-4715, 8), Verdict::kOld);  // the youngest was younger
}

TEST(AgeJudge, AClockThatWasSetIsRightAfterTheReply) {
  Judged j;
  EXPECT_EQ(j.at(20, 3), Verdict::kFresh);
  EXPECT_EQ(j.at(-3'600'000, 3), Verdict::kOld);
  EXPECT_EQ(j.at(20, 4), Verdict::kFresh);
  EXPECT_FALSE(j.judge.is_ahead());
}

TEST(AgeJudge, AClockThatIsNoLongerAheadIsFollowed) {
  Judged j;
  EXPECT_EQ(j.at(-5000, 1), Verdict::kOld);
  EXPECT_EQ(j.at(-5000, 2), Verdict::kFreshAhead);
  EXPECT_EQ(j.at(20, 2), Verdict::kOld);
  EXPECT_EQ(j.at(25, 3), Verdict::kFresh);
  EXPECT_FALSE(j.judge.is_ahead());
}

// A path that was blocked for 5 s gives its commands in a burst.
TEST(AgeJudge, ABurstOfOldCommandsIsOldThoughItsClockWasAhead) {
  Judged j;
  EXPECT_EQ(j.at(-5000, 1), Verdict::kOld);
  EXPECT_EQ(j.at(-5000, 2), Verdict::kFreshAhead);
  std::uint64_t replies = 2;
  for (int age = 100; age > -4600; age -= 100)
    EXPECT_EQ(j.at(age, ++replies), Verdict::kOld) << age;
  EXPECT_EQ(j.at(-4990, replies), Verdict::kFresh);
}

TEST(AgeJudge, ACommandThatIsOldAfterTheReplyStaysOld) {
  Judged j;
  EXPECT_EQ(j.at(-5000, 1), Verdict::kOld);
  EXPECT_EQ(j.at(-5000, 2), Verdict::kFreshAhead);
  EXPECT_EQ(j.at(500, 2), Verdict::kOld);
  EXPECT_EQ(j.at(500, 3), Verdict::kOld);
  EXPECT_EQ(j.at(20, 3), Verdict::kFresh);
}

}  // namespace
}  // namespace connect_bridge::driving
