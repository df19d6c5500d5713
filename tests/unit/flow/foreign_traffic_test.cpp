// Bulk and urgent messages beside connections of somebody else.
#include <gtest/gtest.h>

#include "unit/flow/path_bed.hpp"

namespace connect_bridge::flow_test {
namespace {

using namespace std::chrono_literals;

// Somebody at this end loads something: acknowledgements come 200 ms late, and say nothing about
// the way there.
TEST(ForeignTraffic, AQueueOnTheWayBackDoesNotHoldUpBulk) {
  for (const double back : {4, 18, 58}) {
    auto options = thin_link();
    options.back.rate = megabits(back);
    options.back.foreign_from = 3s;
    options.back.foreign_to = options.lasts = 20s;
    options.warm_up = 5s;
    const auto there = run_bed(options).there;
    EXPECT_GT(there.bulk_share, 0.8) << back;
    EXPECT_LT(there.percentile_ms(0.5), 3) << back;
    EXPECT_LT(there.percentile_ms(0.99), 30) << back;
  }
}

// Bulk that is more than the path carries, beside a connection of somebody else.
BedOptions beside_somebody_else(double rate, Duration foreign_from, Duration bulk_from) {
  auto options = thin_link();
  options.there.rate = megabits(rate);
  options.there.bulk_per_second = rate;
  options.there.bulk_from = bulk_from;
  options.there.foreign_from = foreign_from;
  options.there.foreign_to = options.lasts = 20s;
  options.warm_up = 8s;
  return options;
}

// It fills the queue whatever we do: holding back for ever would leave it all.
TEST(ForeignTraffic, BesideSomebodyElseBulkHasAShare) {
  for (const double rate : {4, 18, 58}) {
    const auto there = run_bed(beside_somebody_else(rate, 4s, 0s)).there;
    EXPECT_GT(there.bulk_share, 0.3) << rate;
    EXPECT_LT(there.bulk_share, 0.6) << rate;
  }
}

TEST(ForeignTraffic, ANewConnectionBesideSomebodyElseHasAShare) {
  for (const double rate : {4, 18, 58}) {
    EXPECT_GT(run_bed(beside_somebody_else(rate, 1ms, 2s)).there.bulk_share, 0.25) << rate;
  }
}

// Images with pauses between them that are less than its share.
TEST(ForeignTraffic, BesideSomebodyElseWhatFitsIsNotSlowedDown) {
  for (const double rate : {18, 58}) {
    auto options = beside_somebody_else(rate, 4s, 0s);
    options.there.bulk_per_second = 5;
    options.there.bulk_bytes = rate > 20 ? 240'000 : 80'000;
    options.there.foreign_to = options.lasts = 30s;
    const double offered = 5.0 * options.there.bulk_bytes * 8 / (rate * 1e6);
    EXPECT_GT(run_bed(options).there.bulk_share, 0.97 * offered) << rate;
  }
}

TEST(ForeignTraffic, WhenSomebodyElseHasLeftThePathHasNoQueueOfOurs) {
  auto options = thin_link();
  options.there.foreign_from = 4s;
  options.there.foreign_to = 12s;
  options.lasts = 30s;
  const auto there = run_bed(options).there;
  EXPECT_LT(there.worst_ms(20s, 30s), 10);
}

}  // namespace
}  // namespace connect_bridge::flow_test
