#include "net/tcp/congestion_choice.hpp"

#include <gtest/gtest.h>

#include <string>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

// Again and again some segments are sent and some of them lost.
class CongestionChoiceTest : public testing::Test {
 protected:
  // What is in use after so many such pauses.
  std::string after(int count, std::uint64_t segments, std::uint64_t lost, Duration pause = 250ms) {
    for (int i = 0; i < count; ++i) {
      counts_.segments += segments;
      counts_.lost += lost;
      now_ += pause;
      if (!choice_.is_due(now_)) continue;
      if (const auto changed = choice_.next(counts_, now_)) {
        EXPECT_NE(*changed, used_);
        used_ = *changed;
      }
    }
    return used_;
  }

  CongestionChoice choice_;
  TcpCounts counts_;
  TimePoint now_{1h};
  std::string used_{CongestionChoice::kFirst};
};

TEST_F(CongestionChoiceTest, StaysWhereNothingIsLost) {
  EXPECT_EQ(after(4000, 400, 0), "cubic");
}

TEST_F(CongestionChoiceTest, LossesTakeBbrUntilItIsCalm) {
  EXPECT_EQ(after(3, 150, 2), "cubic");
  EXPECT_EQ(after(1, 150, 2), "bbr");
  EXPECT_EQ(after(58, 600, 0, 1s), "bbr");
  EXPECT_EQ(after(4, 150, 2), "bbr");  // once more
  EXPECT_EQ(after(59, 600, 0, 1s), "bbr");
  EXPECT_EQ(after(3, 600, 0, 1s), "cubic");
}

// One in 100 is lost on a path of 18 Mbit/s, of which cubic uses a third.
TEST_F(CongestionChoiceTest, OneInAHundredIsSeenWithinTwoSeconds) {
  EXPECT_EQ(after(8, 120, 1), "bbr");
}

// A cell hands over, or somebody else has filled the queue: what is lost is repaired soon.
TEST_F(CongestionChoiceTest, OneBurstOfLossesIsNoWeather) {
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(after(2, 150, 30), "cubic");
    EXPECT_EQ(after(12, 150, 0), "cubic");
  }
}

// TCP repeats the same segments after 0.2, 0.6 and 1.4 s.
TEST_F(CongestionChoiceTest, APathThatWasGoneIsNoWeather) {
  EXPECT_EQ(after(4, 300, 0), "cubic");
  for (const int pause : {1, 2, 4}) EXPECT_EQ(after(pause, 8, 8), "cubic");
  EXPECT_EQ(after(1, 300, 20), "cubic");
  EXPECT_EQ(after(8, 300, 0), "cubic");
}

TEST_F(CongestionChoiceTest, AKernelThatDoesNotTellIsNotAskedAllTheTime) {
  EXPECT_TRUE(choice_.is_due(now_));
  EXPECT_FALSE(choice_.next({}, now_));
  EXPECT_FALSE(choice_.is_due(now_ + 99ms));
  EXPECT_TRUE(choice_.is_due(now_ + 100ms));
}

// The repair of a burst takes some round trips.
TEST_F(CongestionChoiceTest, WithLongRoundTripsItLooksMoreRarely) {
  counts_.round_trip = 600ms;
  EXPECT_EQ(after(9, 100, 5), "cubic");
  EXPECT_EQ(after(100, 100, 0), "cubic");
}

TEST_F(CongestionChoiceTest, FewSegmentsAreJudgedTogether) {
  EXPECT_EQ(after(4, 45, 1, 1s), "cubic");
  EXPECT_EQ(after(2, 45, 1, 1s), "bbr");
}

// They are less than 200 in half a minute.
TEST_F(CongestionChoiceTest, VeryFewSegmentsAreNotJudged) {
  EXPECT_EQ(after(100, 6, 1, 1s), "cubic");
}

TEST_F(CongestionChoiceTest, TwoInAThousandAreFewEnough) {
  EXPECT_EQ(after(100, 1500, 3, 1s), "cubic");
}

TEST_F(CongestionChoiceTest, LooksThatFollowAtOnceAreOne) {
  EXPECT_EQ(after(200, 10, 1, 1ms), "cubic");
  EXPECT_EQ(after(200, 10, 0, 1ms), "cubic");
}

// Segments that turn out to have come twice are no losses any more.
TEST_F(CongestionChoiceTest, ACountThatFallsIsNoLoss) {
  EXPECT_EQ(after(2, 600, 3), "cubic");
  counts_.lost = 0;
  EXPECT_EQ(after(1, 600, 0), "cubic");
  EXPECT_EQ(after(2, 600, 3), "cubic");  // counted before
}

// The kernel counts modulo 2^32.
TEST_F(CongestionChoiceTest, ACountThatBeginsAgainBeginsAgain) {
  counts_.segments = 1ULL << 32;
  EXPECT_EQ(after(3, 600, 2), "cubic");
  counts_ = {};
  EXPECT_EQ(after(3, 600, 2), "cubic");
  EXPECT_EQ(after(1, 600, 2), "bbr");
}

}  // namespace
}  // namespace connect_bridge
