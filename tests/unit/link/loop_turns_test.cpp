#include "core/link/loop_turns.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace connect_bridge::test {
namespace {

using namespace std::chrono_literals;

// A loop in which each step takes what the connection's packets cost.
struct Scene {
  LoopTurns turns{500ms};
  TimePoint now{};
  std::map<std::uint64_t, Payer> payers;  // by connection
  std::map<std::uint64_t, Duration> costs;

  void is_of(std::uint64_t connection, const Payer& payer, Duration cost) {
    payers[connection] = payer;
    costs[connection] = cost;
  }
  void wait(std::uint64_t connection) {
    turns.wait({{static_cast<std::uint32_t>(connection)}, false, {}}, payers.at(connection), now);
  }
  // The connection that had its turn, or 0.
  std::uint64_t step() {
    const auto next = turns.take(now);
    if (!next) return 0;
    now += costs.at(next->connection.value);
    payers.at(next->connection.value)->add(costs.at(next->connection.value), now);
    return next->connection.value;
  }
};

Payer somebody() {
  return std::make_shared<LoopTime>();
}

TEST(LoopTurns, WhoUsesLittleWaitsForOneStepHoweverManyUseMuch) {
  Scene s;
  for (std::uint64_t n = 1; n <= 64; ++n) {  // of eight identities
    s.is_of(n, n <= 8 ? somebody() : s.payers.at(1 + n % 8), 5ms);
    s.wait(n);
  }
  s.is_of(100, somebody(), 100us);
  for (int i = 0; i < 8; ++i) s.wait(s.step());
  for (int round = 0; round < 200; ++round) {
    for (int i = 0; i < 4; ++i) s.wait(s.step());
    s.wait(100);
    EXPECT_EQ(s.step(), 100U);
  }
}

TEST(LoopTurns, TimeIsSharedByIdentitiesAndNotByConnections) {
  Scene s;
  const Payer many = somebody();
  for (std::uint64_t n = 1; n <= 7; ++n) s.is_of(n, many, 1ms);
  s.is_of(8, somebody(), 2ms);
  for (const auto& [connection, payer] : s.payers) s.wait(connection);
  std::map<bool, Duration> used;
  for (int i = 0; i < 100; ++i) {
    const auto next = s.step();
    used[next == 8] += s.costs.at(next);
    s.wait(next);
  }
  EXPECT_NEAR(used[true] / 1us, used[false] / 1us, 3000);
}

TEST(LoopTurns, ConnectionsOfOneIdentityTakeTurns) {
  Scene s;
  const Payer own = somebody();
  for (std::uint64_t n = 1; n <= 3; ++n) {
    s.is_of(n, own, 1ms);
    s.wait(n);
  }
  for (const std::uint64_t expected : {1U, 2U, 3U, 1U, 2U}) {
    EXPECT_EQ(s.step(), expected);
    s.wait(expected);
  }
}

TEST(LoopTurns, WhatSomebodyUsedIsForgotten) {
  Scene s;
  s.is_of(1, somebody(), 1ms);
  s.is_of(2, somebody(), 1ms);
  s.payers.at(1)->add(100ms, s.now);
  s.now += 10s;
  s.wait(2);
  EXPECT_EQ(s.step(), 2U);
  s.wait(2);
  s.wait(1);
  EXPECT_EQ(s.step(), 1U);
}

TEST(LoopTurns, WhoUsedMuchIsReadInTimeAndOthersBetween) {
  Scene s;
  s.is_of(1, somebody(), 100us);
  s.is_of(2, somebody(), 1ms);
  s.payers.at(2)->add(1h, s.now);
  s.wait(1);
  s.wait(2);
  TimePoint last{};
  for (int i = 0; i < 20'000; ++i) {
    s.payers.at(2)->add(1s, s.now);
    const auto next = s.step();
    if (next == 2) {
      EXPECT_LE(s.now - last, 510ms);
      last = s.now;
    }
    s.wait(next);
  }
  EXPECT_GT(last, TimePoint{} + 1s);
  // Many who have waited do not come before one who has used less, but one by one.
  for (std::uint64_t n = 3; n <= 30; ++n) {
    s.is_of(n, s.payers.at(2), 1ms);
    s.wait(n);
  }
  s.now += 600ms;
  for (int i = 0; i < 20; ++i) {
    const auto one = s.step();
    const auto other = s.step();
    EXPECT_TRUE(one == 1 || other == 1);
    s.wait(1);
  }
}

TEST(LoopTurns, WhoIsAloneIsReadAtOnce) {
  Scene s;
  s.is_of(1, somebody(), 5ms);
  s.payers.at(1)->add(1h, s.now);
  s.wait(1);
  EXPECT_EQ(s.step(), 1U);
  EXPECT_EQ(s.step(), 0U);
}

TEST(LoopTurns, WhoIsGoneHasNoTurn) {
  Scene s;
  s.is_of(1, somebody(), 1ms);
  s.wait(1);
  s.turns.forget({1});
  EXPECT_TRUE(s.turns.empty());
  EXPECT_EQ(s.step(), 0U);
}

// Lines are kept for those who come back; the order knows only who waits.
TEST(LoopTurns, WhoComesBackWaitsLikeOneWhoIsNew) {
  Scene s;
  s.is_of(1, somebody(), 2ms);
  s.is_of(2, somebody(), 1ms);
  for (int i = 0; i < 100; ++i) {
    s.wait(1);
    EXPECT_FALSE(s.turns.come_before(*s.payers.at(1), s.now, s.now));
    EXPECT_EQ(s.step(), 1U);
    EXPECT_TRUE(s.turns.empty());
    s.wait(1);
    s.wait(2);
    EXPECT_TRUE(s.turns.come_before(*s.payers.at(1), s.now, s.now));
    EXPECT_EQ(s.step(), 2U);
    EXPECT_EQ(s.step(), 1U);
    EXPECT_EQ(s.step(), 0U);
  }
}

TEST(LoopTurns, WhoWaitsStaysHoweverManyComeAndGo) {
  Scene s;
  s.is_of(1, somebody(), 1ms);
  s.payers.at(1)->add(1h, s.now);
  s.wait(1);
  for (std::uint64_t n = 2; n <= 1000; ++n) {
    s.is_of(n, somebody(), 100us);
    s.wait(n);
    EXPECT_EQ(s.step(), n);
    if (n % 3 == 0) s.turns.forget({static_cast<std::uint32_t>(n)});
  }
  s.wait(500);
  EXPECT_EQ(s.step(), 500U);
  EXPECT_EQ(s.step(), 1U);
  EXPECT_EQ(s.step(), 0U);
}

}  // namespace
}  // namespace connect_bridge::test
