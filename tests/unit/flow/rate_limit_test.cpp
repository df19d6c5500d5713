#include "core/flow/rate_limit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "core/flow/packet_groups.hpp"

namespace connect_bridge {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TimePoint at(Duration since_start) {
  return TimePoint{} + since_start;
}

// How many messages of `bytes` pass of those that come every `period` for ten seconds.
int passed(RateLimit& limit, std::size_t bytes, Duration period) {
  int count = 0;
  for (Duration t{}; t < seconds(10); t += period) count += limit.admit(bytes, 0, at(t)) ? 1 : 0;
  return count;
}

TEST(RateLimit, WithoutLimitsAllPass) {
  RateLimit none;
  EXPECT_EQ(passed(none, 1 << 30, milliseconds(1)), 10'000);
  RateLimit zero(0, 0);
  EXPECT_EQ(passed(zero, 1 << 30, milliseconds(1)), 10'000);
  RateLimit nonsense(-1, 0);
  EXPECT_EQ(passed(nonsense, 1, milliseconds(1)), 10'000);
}

TEST(RateLimit, TheRateOfMessagesIsKept) {
  RateLimit fast(15, 0);
  EXPECT_NEAR(passed(fast, 1, milliseconds(1)), 150, 1);
  RateLimit half(10, 0);
  EXPECT_EQ(passed(half, 1, milliseconds(50)), 100);
  RateLimit slower_source(15, 0);
  EXPECT_EQ(passed(slower_source, 1, milliseconds(100)), 100);
}

TEST(RateLimit, ASourceOfExactlyThatRatePassesThoughItShakes) {
  std::mt19937_64 random(1);
  RateLimit limit(10, 0);
  for (int i = 0; i < 1000; ++i) {
    const auto shake = milliseconds(random() % 24);
    EXPECT_TRUE(limit.admit(1, 0, at(milliseconds(100 * i) + shake))) << i;
  }
}

TEST(RateLimit, TheRateOfBytesIsKeptWhateverTheSizes) {
  RateLimit small(0, 1'000'000);
  EXPECT_NEAR(passed(small, 1000, milliseconds(1)), 10'000, 0);
  RateLimit flood(0, 1'000'000);
  EXPECT_NEAR(passed(flood, 10'000, milliseconds(1)), 1000, 11);  // and 100 ms of burst
  RateLimit large(0, 1'000'000);
  EXPECT_EQ(passed(large, 2'500'000, milliseconds(100)), 5);  // at 0, 2.4, 4.9, 7.4, 9.9 s
}

// A node sends the frames of several parts in turn.
TEST(RateLimit, EachStateHasItsOwnWindowsAndTheBytesAreShared) {
  RateLimit limit(10, 0);
  int passed_of[3] = {};
  for (int i = 0; i < 3000; ++i)
    passed_of[i % 3] +=
        limit.admit(1, 0, at(milliseconds(10 * (i / 3)) + milliseconds(i % 3)), i % 3) ? 1 : 0;
  for (const int passed : passed_of) EXPECT_NEAR(passed, 100, 1);
  RateLimit bytes(0, 1000);
  EXPECT_TRUE(bytes.admit(1000, 0, at(seconds(0)), 1));
  EXPECT_FALSE(bytes.admit(1000, 0, at(milliseconds(500)), 2));
}

// As many states as it likes give a publisher no more than windows for kStatesMax.
TEST(RateLimit, FurtherStatesShareWindows) {
  RateLimit limit(1, 0);
  std::size_t passed = 0;
  for (std::uint64_t state = 1; state <= 4 * RateLimit::kStatesMax; ++state)
    passed += limit.admit(1, 0, at(milliseconds(1)), state) ? 1 : 0;
  EXPECT_EQ(passed, RateLimit::kStatesMax + 1);
  EXPECT_EQ(limit.states(), RateLimit::kStatesMax + 1);
  EXPECT_TRUE(limit.admit(1, 0, at(seconds(3)), 9999));
  EXPECT_EQ(limit.states(), 1U);  // the idle ones are forgotten
}

// A refused message is held by the owner of its windows, so states without end hold one together.
TEST(RateLimit, FurtherStatesHaveOneKey) {
  RateLimit limit(1, 0);
  std::set<std::uint64_t> keys;
  for (std::uint64_t state = 1; state <= 4 * RateLimit::kStatesMax; ++state) {
    (void)limit.admit(1, 0, at(milliseconds(1)), state);
    keys.insert(limit.key(state));
  }
  EXPECT_EQ(keys.size(), RateLimit::kStatesMax + 1);
  EXPECT_EQ(limit.key(5), 5U);
  EXPECT_EQ(limit.key(1000), limit.key(1001));
  EXPECT_EQ(limit.leaves_at(1000), at(milliseconds(1001)));
  limit.leave(1, at(milliseconds(1001)), 1000);
  // A state has no windows of its own before what is held for it has left.
  EXPECT_FALSE(limit.admit(1, 0, at(milliseconds(1002)), 1000));
  EXPECT_EQ(limit.key(1000), limit.key(1001));
  RateLimit bytes(0, 1000);
  EXPECT_EQ(bytes.key(1), bytes.key(2));
}

TEST(RateLimit, IsIdleAPeriodAfterTheNewestMessageOfAnyState) {
  RateLimit limit(1, 0);
  EXPECT_TRUE(limit.idle(at(seconds(0))));
  EXPECT_TRUE(limit.admit(1, 0, at(seconds(0)), 1));
  EXPECT_TRUE(limit.admit(1, 0, at(milliseconds(500)), 2));
  EXPECT_FALSE(limit.admit(1, 0, at(milliseconds(700)), 2));
  EXPECT_FALSE(limit.idle(at(milliseconds(1699))));
  EXPECT_TRUE(limit.idle(at(milliseconds(1700))));
  RateLimit bytes(0, 1000);
  EXPECT_TRUE(bytes.admit(1000, 0, at(seconds(0))));
  EXPECT_FALSE(bytes.idle(at(milliseconds(899))));
  EXPECT_TRUE(bytes.idle(at(milliseconds(900))));
}

TEST(RateLimit, BothLimitsHoldAndARefusedMessageCostsNothing) {
  RateLimit limit(10, 1'000'000);
  EXPECT_TRUE(limit.admit(1000, 0, at(seconds(1))));
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(limit.admit(1'000'000, 0, at(seconds(1))));
  EXPECT_TRUE(limit.admit(1000, 0, at(milliseconds(1100))));
}

TEST(RateLimit, OfIdleTimeOneMessageIsSavedUp) {
  RateLimit limit(10, 0);
  EXPECT_TRUE(limit.admit(1, 0, at(seconds(1))));
  EXPECT_TRUE(limit.admit(1, 0, at(seconds(3600))));
  EXPECT_TRUE(limit.admit(1, 0, at(seconds(3600))));
  EXPECT_FALSE(limit.admit(1, 0, at(seconds(3600))));
}

// github.com/ros/ros_comm issue 560: a throttle gave far less than what it was asked for.
TEST(RateLimit, TheAverageIsWhatWasAskedFor) {
  for (const auto& [source, asked] : {std::pair(30, 20), std::pair(50, 30), std::pair(30, 25)}) {
    RateLimit limit(asked, 0);
    int count = 0;
    for (int i = 0; i < 100 * source; ++i)
      count += limit.admit(1, 0, at(std::chrono::nanoseconds(1'000'000'000LL * i / source)));
    EXPECT_NEAR(count, 100 * asked, 2) << source << " to " << asked;
  }
}

// An image and its CameraInfo: two topics with one stamp, which arrive at different times.
TEST(RateLimit, TopicsThatShareStampsLetTheSameMessagesPass) {
  std::mt19937_64 random(1);
  RateLimit images(5, 0);
  RateLimit infos(5, 0);
  for (int i = 0; i < 3000; ++i) {
    const Stamp stamp = 1'700'000'000 * kStampSecond + kStampSecond / 30 * i;
    const Duration taken = milliseconds(33) * i;
    const bool image = images.admit(1, stamp, at(taken + milliseconds(random() % 30)));
    EXPECT_EQ(infos.admit(1, stamp, at(taken + milliseconds(random() % 30))), image) << i;
  }
}

// A peer may write what it likes into its stamps.
TEST(RateLimit, StampsLetNoMorePassThanTheTimeHere) {
  RateLimit limit(10, 0);
  int count = 0;
  for (int i = 1; i <= 10'000; ++i)
    count += limit.admit(1, 200'000'000LL * i, at(milliseconds(i))) ? 1 : 0;
  EXPECT_NEAR(count, 100, 6);
  RateLimit now_and_then(10, 0);
  count = 0;
  for (int i = 1; i <= 10'000; ++i)
    count += now_and_then.admit(1, i % 2 * 200'000'000LL * i, at(milliseconds(i))) ? 1 : 0;
  EXPECT_NEAR(count, 100, 6);
}

// A path stands for a while, and all comes at once.
TEST(RateLimit, WhatWasPublishedEvenlyPassesThoughAPathHeldItUp) {
  RateLimit limit(10, 0);
  const auto admit = [&](int i, Duration now) {
    return limit.admit(1, kStampSecond * 1000 + kStampSecond / 10 * i, at(now));
  };
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(admit(i, milliseconds(100) * i)) << i;
  for (int i = 100; i < 600; ++i) EXPECT_TRUE(admit(i, seconds(60))) << i;
  for (int i = 600; i < 700; ++i) EXPECT_TRUE(admit(i, milliseconds(100) * i)) << i;
}

TEST(RateLimit, OfAnHourAMinuteIsSavedUpForStamps) {
  RateLimit limit(10, 0);
  EXPECT_TRUE(limit.admit(1, kStampSecond, at(seconds(1))));
  int count = 0;
  for (int i = 1; i <= 10'000; ++i)
    count += limit.admit(1, kStampSecond + kStampSecond * i, at(seconds(3600))) ? 1 : 0;
  EXPECT_NEAR(count, 600, 2);
}

TEST(RateLimit, AStampThatStandsIsNoTime) {
  RateLimit limit(10, 0);
  int count = 0;
  for (int i = 0; i < 1000; ++i)
    count += limit.admit(1, 5 * kStampSecond, at(milliseconds(10) * i));
  EXPECT_NEAR(count, 100, 2);
}

TEST(RateLimit, WhatWasRefusedLeavesAfterAPeriodOfSilence) {
  RateLimit limit(10, 0);
  EXPECT_TRUE(limit.admit(1, 0, at(seconds(1))));
  EXPECT_FALSE(limit.admit(1, 0, at(milliseconds(1020))));
  EXPECT_EQ(limit.leaves_at(), at(milliseconds(1120)));
  limit.leave(1, at(milliseconds(1120)));
  EXPECT_FALSE(limit.admit(1, 0, at(milliseconds(1130))));  // it counted
  RateLimit bytes(0, 1000);
  EXPECT_TRUE(bytes.admit(500, 0, at(seconds(1))));
  EXPECT_FALSE(bytes.admit(500, 0, at(milliseconds(1020))));
  EXPECT_EQ(bytes.leaves_at(), at(milliseconds(1400)));  // 100 ms early, as any burst
}

// ---- packets of videos: 30 a second, a key frame each second

struct Passed {
  int keys = 0;
  int packets = 0;
  bool torn = false;  // one passed that refers to one that did not
};
Passed passed_of_video(RateLimit& limit, int lasting, std::size_t bytes = 1000, int period = 30) {
  Passed passed;
  bool before = false;
  for (int i = 0; i < 30 * lasting; ++i) {
    const bool is_key = i % period == 0;
    const TimePoint now = at(seconds(1) * i / 30);
    const bool passes =
        limit.admit(bytes, 0, now, 7, is_key ? VideoPart::kKey : VideoPart::kRefers);
    passed.keys += passes && is_key ? 1 : 0;
    passed.packets += passes ? 1 : 0;
    passed.torn = passed.torn || (passes && !is_key && !before);
    before = passes;
  }
  return passed;
}

TEST(RateLimit, AGroupOfAVideoPassesUpToWhatIsTooMuch) {
  for (const double rate : {0.5, 1.0, 2.0, 10.0, 25.0}) {
    RateLimit limit(rate, 0);
    const Passed passed = passed_of_video(limit, 100);
    EXPECT_FALSE(passed.torn) << rate;
    EXPECT_LE(passed.packets, 101 * rate + 2) << rate;
    EXPECT_GE(passed.packets, 90 * rate) << rate;
    EXPECT_GE(passed.keys, std::min(99.0, 99 * rate)) << rate;
  }
  RateLimit bytes(0, 10'000);
  const Passed passed = passed_of_video(bytes, 100);
  EXPECT_FALSE(passed.torn);
  EXPECT_NEAR(passed.packets, 1000, 50);
  EXPECT_GE(passed.keys, 99);
}

TEST(RateLimit, AVideoWithinTheRateIsWhole) {
  RateLimit limit(30, 100'000);
  EXPECT_EQ(passed_of_video(limit, 100).packets, 3000);
  RateLimit none;
  EXPECT_EQ(passed_of_video(none, 100).packets, 3000);
}

TEST(RateLimit, EachCameraHasItsOwnGroups) {
  RateLimit limit(0, 1000);
  EXPECT_TRUE(limit.admit(1000, 0, at(seconds(1)), 1, VideoPart::kKey));
  EXPECT_TRUE(limit.admit(1000, 0, at(seconds(1)), 2, VideoPart::kKey));
  EXPECT_FALSE(limit.admit(1000, 0, at(seconds(1)), 1, VideoPart::kRefers));
  EXPECT_FALSE(limit.admit(1000, 0, at(seconds(1)), 2, VideoPart::kRefers));
  EXPECT_TRUE(limit.admit(1000, 0, at(seconds(9)), 1, VideoPart::kKey));
  EXPECT_FALSE(limit.admit(1000, 0, at(seconds(11)), 2, VideoPart::kRefers));
  EXPECT_TRUE(limit.admit(1000, 0, at(seconds(11)), 1, VideoPart::kRefers));
}

// Names without end: new windows are made when old ones would let as much pass.
TEST(RateLimit, CamerasAndStatesWithoutEndGetNoMoreThanThoseThatStay) {
  const auto passed = [](VideoPart part, bool all_are_new) {
    RateLimit limit(10, 0);
    Stamp stamp = 0;
    int count = 0;
    for (std::uint64_t turn = 0; turn < 20; ++turn)
      for (std::uint64_t n = 0; n < 10 * RateLimit::kStatesMax; ++n) {
        stamp += 200'000'000;
        const std::uint64_t name = n % RateLimit::kStatesMax;
        count += limit.admit(1, stamp, at(milliseconds(101 * turn)),
                             all_are_new ? turn * RateLimit::kStatesMax + name : name, part)
                     ? 1
                     : 0;
      }
    return count;
  };
  for (const VideoPart part : {VideoPart::kKey, VideoPart::kNone}) {
    EXPECT_LE(passed(part, true), passed(part, false));
    EXPECT_LE(passed(part, false), static_cast<int>(RateLimit::kStatesMax) * 10 * 4);
  }
}

TEST(RateLimit, AVideoWithoutKeyFramesGoesOn) {
  RateLimit limit(10, 0);
  const int each = PacketGroups::kSkippedMax / 30;  // s
  const Passed passed = passed_of_video(limit, 10 * each, 1000, 30 * 1000);
  EXPECT_EQ(passed.keys, 1);
  EXPECT_GT(passed.packets, 50);
  EXPECT_LE(passed.packets, 10 * 10 * each);
}

TEST(RateLimit, ExtremesDoNotOverflow) {
  RateLimit limit(1e-300, 1);
  EXPECT_TRUE(limit.admit(std::size_t{1} << 62, 0, at(seconds(1))));
  EXPECT_FALSE(limit.admit(1, 0, at(seconds(1'000'000))));
}

}  // namespace
}  // namespace connect_bridge
