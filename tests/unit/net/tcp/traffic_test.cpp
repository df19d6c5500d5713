#include "net/tcp/traffic.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

TEST(TrafficMeter, CountsBytesAndTheHeadersOfSegments) {
  TrafficMeter meter{52};
  meter.count({1000, 100, 10, 5});
  EXPECT_EQ(meter.total().sent, 1000U + 10 * 52);
  EXPECT_EQ(meter.total().received, 100U + 5 * 52);
}

// The kernel counts them with 32 bits: with 2,000 a second they begin again after 25 days.
TEST(TrafficMeter, GoesOnWhenSegmentsBeginAgain) {
  TrafficMeter meter{52};
  meter.count({0, 0, 4'000'000'000, 1});
  const auto before = meter.total().sent;
  meter.count({0, 0, 4'294'967'295, 2});
  meter.count({5, 0, 4, 3});
  EXPECT_EQ(meter.total().sent - before, 294'967'295ULL * 52 + 5 + 5 * 52);
}

TEST(TrafficMeter, AnAbortedSocketTakesNothingBack) {
  TrafficMeter meter{52};
  meter.count({10, 10, 1, 1});
  meter.count({0, 0, 0, 0});
  EXPECT_EQ(meter.total().sent, 62U);
  meter.count({20, 10, 2, 1});
  EXPECT_EQ(meter.total().sent, 20U + 2 * 52);
}

}  // namespace
}  // namespace connect_bridge
