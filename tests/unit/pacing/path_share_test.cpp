#include "core/pacing/path_share.hpp"

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
  std::uint64_t arrived_bytes = 0;
  double best = 0;  // of some round trips, where that is more than what arrives

  template <class Carries>
  void run(Duration lasts, const Carries& carries) {
    for (const TimePoint end = now + lasts; now < end; now += kRound) {
      // The share is all that leaves beside somebody else.
      const double delivery = carries(share.rate());
      arrived_bytes += static_cast<std::uint64_t>(delivery / 10);
      share.end_round({.delivery = best > 0 ? best : delivery,
                       .arrived_bytes = arrived_bytes,
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
    share.begin({.delivery = leaves,
                 .arrived_bytes = arrived_bytes,
                 .allowed = leaves,
                 .queue = 100ms,
                 .answer = 2 * kRound},
                now);
  }
};

double all_arrives(double leaves) {
  return leaves;
}

TEST(PathShare, AloneThereIsNone) {
  Rounds rounds;
  rounds.alone(1e6);
  EXPECT_EQ(rounds.share.rate(), 0);
  EXPECT_NEAR(rounds.share.best(), 1e6, 1e3);
}

TEST(PathShare, GrowsToHalfOfWhatThePathCarriedAlone) {
  Rounds rounds;
  rounds.alone(1e6);
  rounds.begin(1e4);
  EXPECT_EQ(rounds.share.rate(), 15e3);
  rounds.run(5s, all_arrives);
  EXPECT_NEAR(rounds.share.rate(), 5e5, 1e3);
}

// The delay has grown because the path has become slower: nobody gives way.
TEST(PathShare, WhereMoreDoesNotArriveLessLeaves) {
  Rounds rounds;
  rounds.alone(1e6);
  rounds.begin(1e5);
  rounds.run(5s, [](double leaves) { return std::min(leaves, 1e5); });
  EXPECT_EQ(rounds.share.rate(), 0);
  EXPECT_EQ(rounds.share.best(), 1e5);
}

// A cell that fades, and shakes: at its best moments it carries more than it does.
TEST(PathShare, TheBestMomentIsNotWhatArrives) {
  Rounds rounds;
  rounds.alone(1e6);
  rounds.begin(1e5);
  rounds.best = 4e5;
  rounds.run(5s, [](double leaves) { return std::min(leaves, 1e5); });
  EXPECT_EQ(rounds.share.rate(), 0);
}

// That of somebody else does not: what leaves is a part of it, and he gives way.
TEST(PathShare, WhereTheQueueGrowsNobodyElseIsThere) {
  Rounds rounds;
  rounds.alone(1e6);
  rounds.begin(1e4);
  rounds.run(1s, all_arrives);
  EXPECT_GT(rounds.share.rate(), 0);
  rounds.share.queue_is(80ms);
  EXPECT_GT(rounds.share.rate(), 0);
  rounds.share.queue_is(81ms);
  EXPECT_EQ(rounds.share.rate(), 0);
}

// Otherwise the short queue that a slow path needs would be taken for somebody else's, again and
// again.
TEST(PathShare, WhereTheQueueGrowsThePathIsPerhapsSlower) {
  Rounds rounds;
  rounds.alone(1e6);
  rounds.begin(1e4);
  rounds.share.queue_is(81ms);
  EXPECT_NEAR(rounds.share.best(), 25e4, 1e3);
  rounds.share.queue_is(200ms);  // there is no share now
  EXPECT_NEAR(rounds.share.best(), 25e4, 1e3);
  rounds.begin(1e4);
  rounds.run(5s, all_arrives);
  EXPECT_NEAR(rounds.share.rate(), 125e3, 1e3);
}

TEST(PathShare, WhereTcpLetsLessLeaveNothingIsLearnt) {
  Rounds rounds;
  rounds.alone(1e6);
  rounds.begin(1e5);
  rounds.tcp_limits = true;
  rounds.run(5s, [](double leaves) { return std::min(leaves, 1e5); });
  EXPECT_EQ(rounds.share.rate(), 15e4);
  EXPECT_NEAR(rounds.share.best(), 1e6, 1e3);
}

TEST(PathShare, APathThatWasNeverSeenAloneIsTriedOut) {
  Rounds rounds;
  rounds.begin(1e4);
  rounds.run(5s, [&](double leaves) {
    rounds.share.path_is_not_seen(rounds.now);
    return std::min(leaves, 1e6);
  });
  EXPECT_EQ(rounds.share.rate(), 5e5);
}

TEST(PathShare, DoesNotGrowWhereTheQueueLetsTheRateGrow) {
  Rounds rounds;
  rounds.alone(1e6);
  rounds.begin(1e4);
  rounds.gain = 1;
  rounds.run(2s, all_arrives);
  EXPECT_EQ(rounds.share.rate(), 15e3);
}

TEST(PathShare, EndsWhenItHasNotBeenNeededForThreeSeconds) {
  Rounds rounds;
  rounds.alone(1e6);
  rounds.begin(1e4);
  rounds.run(5s, all_arrives);
  rounds.gain = 1;
  rounds.run(2500ms, [](double) { return 1e6; });
  EXPECT_GT(rounds.share.rate(), 0);
  rounds.run(1s, [](double) { return 1e6; });
  EXPECT_EQ(rounds.share.rate(), 0);
}

}  // namespace
}  // namespace connect_bridge
