#include "core/flow/path_share.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

constexpr Duration kRound = 100ms;

// Rounds on a path; what arrives is told by `carries`, given what leaves.
struct Rounds {
  PathShare share;
  TimePoint now{};
  double gain = 0.5;
  bool tcp_limits = false;

  template <class Carries>
  void run(Duration lasts, const Carries& carries) {
    for (const TimePoint end = now + lasts; now < end; now += kRound) {
      // The share is all that leaves beside somebody else.
      const double delivery = carries(share.rate());
      share.end_round({.delivery = delivery,
                       .allowed = share.rate(),
                       .without = gain * delivery,
                       .gain = gain,
                       .tcp_limits = tcp_limits,
                       .answer = 2 * kRound},
                      now);
    }
  }
  void alone(double rate) {
    run(3s, [&](double) { return rate; });
  }
  void begin(double leaves) {
    share.path_is_not_seen(now);
    share.begin({.delivery = leaves, .allowed = leaves, .answer = 2 * kRound}, now);
  }
};

double all_arrives(double leaves) {
  return leaves;
}

TEST(PathShare, AloneThereIsNone) {
  Rounds rounds;
  rounds.alone(1000);
  EXPECT_EQ(rounds.share.rate(), 0);
  EXPECT_NEAR(rounds.share.best(), 1000, 1);
}

TEST(PathShare, GrowsToHalfOfWhatThePathCarriedAlone) {
  Rounds rounds;
  rounds.alone(1000);
  rounds.begin(10);
  EXPECT_EQ(rounds.share.rate(), 15);
  rounds.run(5s, all_arrives);
  EXPECT_NEAR(rounds.share.rate(), 500, 1);
}

// The delay has grown because the path has become slower: nobody gives way.
TEST(PathShare, WhereMoreDoesNotArriveLessLeaves) {
  Rounds rounds;
  rounds.alone(1000);
  rounds.begin(100);
  rounds.run(5s, [](double leaves) { return std::min(leaves, 100.0); });
  EXPECT_EQ(rounds.share.rate(), 0);
  EXPECT_EQ(rounds.share.best(), 100);
}

TEST(PathShare, WhereTcpLetsLessLeaveNothingIsLearnt) {
  Rounds rounds;
  rounds.alone(1000);
  rounds.begin(100);
  rounds.tcp_limits = true;
  rounds.run(5s, [](double leaves) { return std::min(leaves, 100.0); });
  EXPECT_EQ(rounds.share.rate(), 150);
  EXPECT_NEAR(rounds.share.best(), 1000, 1);
}

TEST(PathShare, APathThatWasNeverSeenAloneIsTriedOut) {
  Rounds rounds;
  rounds.begin(10);
  rounds.run(5s, [&](double leaves) {
    rounds.share.path_is_not_seen(rounds.now);
    return std::min(leaves, 1000.0);
  });
  EXPECT_EQ(rounds.share.rate(), 500);
}

TEST(PathShare, DoesNotGrowWhereTheQueueLetsTheRateGrow) {
  Rounds rounds;
  rounds.alone(1000);
  rounds.begin(10);
  rounds.gain = 1;
  rounds.run(2s, all_arrives);
  EXPECT_EQ(rounds.share.rate(), 15);
}

TEST(PathShare, EndsWhenItHasNotBeenNeededForThreeSeconds) {
  Rounds rounds;
  rounds.alone(1000);
  rounds.begin(10);
  rounds.run(5s, all_arrives);
  rounds.gain = 1;
  rounds.run(2500ms, [](double) { return 1000.0; });
  EXPECT_GT(rounds.share.rate(), 0);
  rounds.run(1s, [](double) { return 1000.0; });
  EXPECT_EQ(rounds.share.rate(), 0);
}

}  // namespace
}  // namespace connect_bridge
