// How what was kept over a break leaves: one by one, and what joins it.
#include "core/flow/replay.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr std::uint64_t kMuchRoom = 1 << 20;

OutMessage kept_of(std::size_t size) {
  OutMessage result = message(size);
  result.resumes = true;
  return result;
}

// So many messages of 100 bytes are left at 0; what comes within a minute may join them.
struct Replaying {
  explicit Replaying(int messages, Duration joins = std::chrono::minutes(1)) {
    subject.begin(now, now + joins);
    for (int i = 0; i < messages; ++i) subject.add(100);
  }
  // The first leaves now. How much later the next may.
  Duration leave(std::uint64_t bytes_max = kMuchRoom) {
    subject.remove(100);
    subject.begun(bytes_max, now);
    return subject.next_at() - now;
  }
  [[nodiscard]] bool takes(const OutMessage& next, std::uint64_t bytes_max = kMuchRoom) const {
    return subject.takes(next, bytes_max, now);
  }

  TimePoint now = now_ms(0).steady;
  Replay subject;
};

TEST(Replay, TheFirstLeavesAtOnce) {
  Replaying s(3);
  EXPECT_EQ(s.subject.next_at(), s.now);
  EXPECT_EQ(s.subject.count(), 3U);
  EXPECT_EQ(s.subject.bytes(), 300U);
}

// A subscriber that keeps ten, and looks away for 20 ms, gets all.
TEST(Replay, FewLeaveTwoMillisecondsApart) {
  Replaying s(3);
  EXPECT_EQ(s.leave(), milliseconds(2));
  s.now += milliseconds(2);
  EXPECT_EQ(s.leave(), milliseconds(2));
  s.now += milliseconds(2);
  EXPECT_EQ(s.leave(), Duration::zero());  // it was the last
}

TEST(Replay, ManyLeaveInHalfASecondAsFarAsSubscribersCanFollow) {
  EXPECT_EQ(Replaying(501).leave(), milliseconds(1));
  EXPECT_EQ(Replaying(2001).leave(), microseconds(800));
}

TEST(Replay, AfterTheTimeForThatTheRestFollowsAsFastAsSubscribersCan) {
  Replaying s(101);
  s.now += milliseconds(400);
  EXPECT_EQ(s.leave(), milliseconds(1));
  s.now += milliseconds(400);
  EXPECT_EQ(s.leave(), microseconds(800));
}

// What joins them faster than they leave must not make them later without end.
TEST(Replay, AfterTenSecondsNoneIsHeldBack) {
  Replaying s(101);
  s.now += milliseconds(9990);
  EXPECT_EQ(s.leave(), microseconds(100));
  s.now += milliseconds(10);
  EXPECT_EQ(s.leave(), Duration::zero());
  s.now += milliseconds(1000);
  EXPECT_EQ(s.leave(), Duration::zero());
}

TEST(Replay, NoneIsHeldBackLongerThanMessagesMayJoin) {
  Replaying s(2, milliseconds(1));
  EXPECT_EQ(s.leave(), milliseconds(1));
}

// Its room is needed.
TEST(Replay, WhatTakesMoreThanHalfOfItsRoomIsNotHeldBack) {
  constexpr std::uint64_t kOne = 100 + kKeptMessageBytes;
  EXPECT_EQ(Replaying(11).leave(2 * 10 * kOne), milliseconds(2));
  EXPECT_EQ(Replaying(11).leave(2 * 10 * kOne - 2), Duration::zero());
}

TEST(Replay, OnlyWhatResumesJoinsThem) {
  const Replaying s(1);
  EXPECT_TRUE(s.takes(kept_of(100)));
  EXPECT_FALSE(s.takes(message(100)));
}

TEST(Replay, NothingJoinsThemWhenAllHaveLeftOrTheTimeIsOver) {
  Replaying s(1, milliseconds(100));
  s.now += milliseconds(99);
  EXPECT_TRUE(s.takes(kept_of(100)));
  s.now += milliseconds(1);
  EXPECT_FALSE(s.takes(kept_of(100)));
  Replaying empty(1);
  empty.leave();
  EXPECT_FALSE(empty.takes(kept_of(100)));
}

TEST(Replay, WhatJoinsThemFitsTheirRoom) {
  constexpr std::uint64_t kOne = 100 + kKeptMessageBytes;
  const Replaying s(2);
  EXPECT_TRUE(s.takes(kept_of(100), 3 * kOne));
  EXPECT_FALSE(s.takes(kept_of(101), 3 * kOne));
}

}  // namespace
}  // namespace connect_bridge::flow_test
