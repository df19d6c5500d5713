#include "core/link/dialer.hpp"

#include <gtest/gtest.h>

#include <set>

#include "unit/flow/script.hpp"

namespace connect_bridge {
namespace {

using flow_test::now_ms;
using std::chrono::milliseconds;
using Wait = DialFailure;

constexpr DialerOptions kOptions{milliseconds(200), milliseconds(500)};

// What a dialer waits after a failure now.
Duration wait_of(Dialer& dialer, Random& random, Wait failure = Wait::kGone) {
  dialer.failed(now_ms(1000).steady, failure, random);
  return *dialer.deadline() - now_ms(1000).steady;
}

TEST(Dialer, TheFirstDialIsDueAtOnceAndOnlyOnce) {
  Dialer dialer(kOptions);
  EXPECT_TRUE(dialer.take_due(TimePoint{}));
  EXPECT_FALSE(dialer.take_due(now_ms(60'000).steady));  // busy
  EXPECT_FALSE(dialer.deadline());
}

TEST(Dialer, TheNextOneIsDueAtItsTime) {
  Random random(1);
  Dialer dialer(kOptions);
  dialer.take_due(TimePoint{});
  dialer.failed(now_ms(0).steady, Wait::kGone, random);
  const TimePoint next = dialer.deadline().value();
  EXPECT_FALSE(dialer.take_due(next - Duration(1)));
  EXPECT_TRUE(dialer.take_due(next));
}

// docs/protocol.md section 7: between half and all of a time that doubles from 200 ms to 0.5 s.
TEST(Dialer, WaitsWithinBoundsThatDouble) {
  const int longest[] = {200, 400, 500, 500, 500, 500};
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed);
    Dialer dialer(kOptions);
    for (const int ms : longest) {
      const Duration wait = wait_of(dialer, random);
      EXPECT_GE(wait, milliseconds(ms) / 2);
      EXPECT_LE(wait, milliseconds(ms));
    }
  }
}

TEST(Dialer, JitterReachesFromEndToEnd) {
  Random random(1);
  Duration shortest = kForever;
  Duration longest{0};
  std::set<Duration> waits;
  for (int i = 0; i < 1000; ++i) {
    Dialer dialer(kOptions);
    const Duration wait = wait_of(dialer, random);
    shortest = std::min(shortest, wait);
    longest = std::max(longest, wait);
    waits.insert(wait);
  }
  EXPECT_LT(shortest, milliseconds(105));
  EXPECT_GT(longest, milliseconds(195));
  EXPECT_GT(waits.size(), 990U);
}

void expect_wait(Dialer& dialer, Random& random, Wait failure, int seconds) {
  const Duration wait = wait_of(dialer, random, failure);
  EXPECT_GE(wait, std::chrono::seconds(seconds));
  EXPECT_LE(wait, milliseconds(1500) * seconds);
}

TEST(Dialer, ARefusedLoginWaitsLongerAndLonger) {
  Random random(1);
  Dialer dialer(kOptions);
  for (const int seconds : {5, 10, 20, 40, 40}) {
    expect_wait(dialer, random, Wait::kRefused, seconds);
    EXPECT_LE(wait_of(dialer, random), milliseconds(500));
  }
  dialer.forget_refusal(now_ms(1000).steady);
  expect_wait(dialer, random, Wait::kRefused, 5);
  dialer.opened();
  expect_wait(dialer, random, Wait::kRefused, 5);
}

TEST(Dialer, ALoginThatIsPutOffIsTriedAsSoonEachTime) {
  Random random(1);
  Dialer dialer(kOptions);
  for (int i = 0; i < 10; ++i) expect_wait(dialer, random, Wait::kPutOff, 5);
  dialer.hurry(now_ms(1200).steady);
  EXPECT_GE(*dialer.deadline(), now_ms(6000).steady);
}

TEST(Dialer, RefusedClientsDoNotReturnAtOnce) {
  Random random(1);
  std::set<Duration> waits;
  for (int i = 0; i < 100; ++i) {
    Dialer dialer(kOptions);
    waits.insert(wait_of(dialer, random, Wait::kRefused));
  }
  EXPECT_GT(waits.size(), 90U);
}

// A proxy that says 502 for a day costs a TLS handshake each time.
TEST(Dialer, WhatIsAnsweredByOthersForLongIsDialedRarely) {
  Random random(1);
  Dialer dialer(kOptions);
  for (int i = 0; i < Dialer::kAnswersSoon; ++i)
    EXPECT_LE(wait_of(dialer, random, Wait::kAnswered), milliseconds(500)) << i;
  for (int i = 0; i < 10; ++i) expect_wait(dialer, random, Wait::kAnswered, 5);
  dialer.hurry(now_ms(1200).steady);  // another network
  EXPECT_EQ(dialer.deadline(), now_ms(1200).steady);
  expect_wait(dialer, random, Wait::kAnswered, 5);
  EXPECT_LE(wait_of(dialer, random), milliseconds(500));  // it is gone: that costs little
  EXPECT_LE(wait_of(dialer, random, Wait::kAnswered), milliseconds(500));
}

// A proxy that says 502 to a whole fleet hears it spread.
TEST(Dialer, DialersThatAreAnsweredByOthersComeSpread) {
  Random random(1);
  std::set<Duration> waits;
  for (int i = 0; i < 100; ++i) {
    Dialer dialer(kOptions);
    for (int answers = 0; answers < Dialer::kAnswersSoon; ++answers)
      wait_of(dialer, random, Wait::kAnswered);
    waits.insert(wait_of(dialer, random, Wait::kAnswered));
  }
  EXPECT_GT(waits.size(), 90U);
}

TEST(Dialer, ALongRetryIsNotShortenedByARefusal) {
  Random random(1);
  Dialer dialer({std::chrono::seconds(20), std::chrono::seconds(60)});
  EXPECT_GE(wait_of(dialer, random, Wait::kRefused), std::chrono::seconds(10));
}

TEST(Dialer, NeverGivesUp) {
  Random random(1);
  Dialer dialer(kOptions);
  for (int i = 0; i < 100'000; ++i) {
    const Duration wait = wait_of(dialer, random);
    ASSERT_GE(wait, milliseconds(100));
    ASSERT_LE(wait, milliseconds(500));
  }
}

TEST(Dialer, SuccessBeginsAnew) {
  Random random(1);
  Dialer dialer(kOptions);
  for (int i = 0; i < 10; ++i) wait_of(dialer, random);
  dialer.opened();
  EXPECT_LE(wait_of(dialer, random), milliseconds(200));
}

TEST(Dialer, AMinimumBeyondTheMaximumHolds) {
  Random random(1);
  Dialer dialer({std::chrono::seconds(10), std::chrono::seconds(1)});
  for (int i = 0; i < 20; ++i) {
    const Duration wait = wait_of(dialer, random);
    EXPECT_GE(wait, std::chrono::seconds(5));
    EXPECT_LE(wait, std::chrono::seconds(10));
  }
}

// Nobody changes its key back within seconds; another network may have the right one.
TEST(Dialer, AfterAnotherKeyItTriesEveryFewMinutesOrInAnotherNetwork) {
  Random random(1);
  Dialer dialer(kOptions);
  for (int i = 0; i < 20; ++i) {
    dialer.failed(now_ms(0).steady, Wait::kOtherKey, random);
    ASSERT_GE(*dialer.deadline(), now_ms(120'000).steady);
    ASSERT_LE(*dialer.deadline(), now_ms(180'000).steady);
  }
  dialer.hurry(now_ms(5).steady);
  EXPECT_EQ(dialer.deadline(), now_ms(5).steady);
}

TEST(Dialer, StopsForGood) {
  Random random(1);
  Dialer dialer(kOptions);
  dialer.failed(now_ms(0).steady, Wait::kGone, random);
  dialer.stop();
  EXPECT_FALSE(dialer.deadline());
  EXPECT_FALSE(dialer.take_due(now_ms(60'000).steady));
}

}  // namespace
}  // namespace connect_bridge
