#include "relay/visitor_paces.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using Kind = VisitorPaces::Kind;

// How many of `times` visitors get to the robot.
int let_in(VisitorPaces& paces, Kind kind, const std::string& network, int times,
           TimePoint now = {}) {
  int count = 0;
  for (int i = 0; i < times; ++i) count += paces.take("robot7", network, kind, now) ? 1 : 0;
  return count;
}

TEST(VisitorPaces, ARobotWithoutAWordGetsAllUpToItsOwnLimit) {
  VisitorPaces paces;
  EXPECT_EQ(let_in(paces, Kind::kAny, "a", 200), kVisitorsAtOnce);
  EXPECT_TRUE(paces.take("robot8", "a", Kind::kAny, {}));
}

TEST(VisitorPaces, OneNetworkWithoutTheWordLeavesRoomForOthers) {
  VisitorPaces paces;
  EXPECT_EQ(let_in(paces, Kind::kOther, "a", 100), kOthersOfNetworkAtOnce);
  EXPECT_EQ(let_in(paces, Kind::kOther, "b", 100), kOthersOfNetworkAtOnce);
  EXPECT_EQ(let_in(paces, Kind::kOther, "c", 100), kOthersAtOnce - 2 * kOthersOfNetworkAtOnce);
  EXPECT_EQ(let_in(paces, Kind::kOther, "d", 100), 0);
  // A minute later: three of all, and one of a network.
  const TimePoint later = TimePoint{} + std::chrono::minutes(1);
  EXPECT_EQ(let_in(paces, Kind::kOther, "a", 100, later), 1);
  EXPECT_EQ(let_in(paces, Kind::kOther, "e", 100, later), 2);
}

// The word is no secret, so what it costs has a limit, too.
TEST(VisitorPaces, VisitorsWithTheWordHaveASum) {
  VisitorPaces paces;
  EXPECT_EQ(let_in(paces, Kind::kOther, "z", 1), 1);
  EXPECT_EQ(let_in(paces, Kind::kClient, "z", kClientsOfNetworkAtOnce + 1),
            kClientsOfNetworkAtOnce);
  TimePoint now{};
  for (int network = 0; network < 100; ++network, now += std::chrono::milliseconds(200))
    let_in(paces, Kind::kClient, std::to_string(network), 10, now);
  // 20 s have passed: of the sum 20 are free again.
  EXPECT_LE(let_in(paces, Kind::kClient, "y", 60, now), 1);
  EXPECT_EQ(let_in(paces, Kind::kClient, "x", 60, now + std::chrono::minutes(10)),
            kClientsOfNetworkAtOnce);
}

TEST(VisitorPaces, AVisitorThatIsRefusedCountsNowhere) {
  VisitorPaces paces;
  EXPECT_EQ(let_in(paces, Kind::kAny, "a", kVisitorsAtOnce), kVisitorsAtOnce);
  EXPECT_EQ(let_in(paces, Kind::kOther, "a", 50), 0);
  EXPECT_EQ(let_in(paces, Kind::kClient, "a", 50), 0);
  const TimePoint later = TimePoint{} + 100 * kVisitorPeriod;
  EXPECT_EQ(let_in(paces, Kind::kOther, "a", 50, later), kOthersOfNetworkAtOnce);
  EXPECT_EQ(let_in(paces, Kind::kClient, "a", 100, later), kClientsOfNetworkAtOnce);
}

}  // namespace
}  // namespace connect_bridge
