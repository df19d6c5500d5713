#include "net/congestion_choice.hpp"

#include <gtest/gtest.h>

#include <string>

namespace connect_bridge {
namespace {

using std::chrono::seconds;

// Every second some segments are sent and some of them lost.
class CongestionChoiceTest : public testing::Test {
 protected:
  // What is in use after so many such seconds.
  std::string after(int count, std::uint64_t segments, std::uint64_t lost) {
    for (int i = 0; i < count; ++i) {
      counts_.segments += segments;
      counts_.lost += lost;
      if (const auto changed = choice_.next(counts_, now_)) {
        EXPECT_NE(*changed, used_);
        used_ = *changed;
      }
      now_ += seconds(1);
    }
    return used_;
  }

  CongestionChoice choice_;
  TcpCounts counts_;
  TimePoint now_{};
  std::string used_{CongestionChoice::kFirst};
};

TEST_F(CongestionChoiceTest, StaysWhereNothingIsLost) {
  EXPECT_EQ(after(1000, 1500, 0), "cubic");
}

TEST_F(CongestionChoiceTest, LossesTakeBbrUntilItIsCalm) {
  EXPECT_EQ(after(1, 600, 6), "cubic");
  EXPECT_EQ(after(1, 600, 6), "bbr");
  EXPECT_EQ(after(58, 600, 0), "bbr");
  EXPECT_EQ(after(1, 600, 6), "bbr");  // once more
  EXPECT_EQ(after(59, 600, 0), "bbr");
  EXPECT_EQ(after(1, 600, 0), "cubic");
}

TEST_F(CongestionChoiceTest, OneBurstOfLossesIsNoWeather) {
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(after(1, 600, 60), "cubic");
    EXPECT_EQ(after(1, 600, 0), "cubic");
  }
}

TEST_F(CongestionChoiceTest, FewSegmentsAreJudgedTogether) {
  EXPECT_EQ(after(4, 50, 1), "cubic");  // 200 segments, 4 lost
  EXPECT_EQ(after(3, 50, 1), "cubic");
  EXPECT_EQ(after(1, 50, 1), "bbr");
}

TEST_F(CongestionChoiceTest, TwoInAThousandAreFewEnough) {
  EXPECT_EQ(after(100, 1500, 3), "cubic");
}

// Segments that turn out to have come twice are no losses any more.
TEST_F(CongestionChoiceTest, ACountThatFallsIsNoLoss) {
  EXPECT_EQ(after(1, 600, 6), "cubic");
  counts_.lost = 0;
  EXPECT_EQ(after(1, 600, 0), "cubic");
  EXPECT_EQ(after(2, 600, 3), "cubic");  // counted before
}

}  // namespace
}  // namespace connect_bridge
