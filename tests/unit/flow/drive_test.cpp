// What docs/flow.md promises, on cellular links under way, in virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "bench/wan_drive.hpp"
#include "unit/flow/path_bed.hpp"

namespace connect_bridge::flow_test {
namespace {

using namespace std::chrono_literals;

constexpr double kSlowest = 1e6 / 8, kFastest = 40e6 / 8;  // bytes per second

// 20 ms each way; more bulk than it carries goes there.
BedOptions cell(double bulk_per_second) {
  BedOptions options;
  options.there.delay = options.back.delay = 20ms;
  options.back.rate = megabits(58);
  options.there.bulk_per_second = bulk_per_second;
  options.lasts = 30s;
  return options;
}

std::function<double(Duration)> stepwise(const std::vector<double>& rates, Duration step) {
  return [&rates, step](Duration at) { return rates.at(static_cast<std::size_t>(at / step)); };
}

// 1 to 40 Mbit/s, changing every 100 ms: the wildest of cells.
TEST(Drive, IsFollowed) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    std::mt19937_64 draw(seed);
    std::normal_distribution<double> step(0, 0.45);
    std::vector<double> rates{10e6 / 8};
    while (rates.size() < 300)
      rates.push_back(std::clamp(rates.back() * std::exp(step(draw)), kSlowest, kFastest));
    auto options = cell(20);
    options.there.rate = stepwise(rates, 100ms);
    const auto there = run_bed(options).there;
    EXPECT_LT(there.percentile_ms(0.5), 6) << "seed " << seed;
    EXPECT_LT(there.percentile_ms(0.9), 45) << "seed " << seed;
    EXPECT_GT(there.bulk_share, 0.78) << "seed " << seed;
  }
}

// From one hundredth of a second to the next its rate is three times as high or as low, as the
// scheduler of a cell allots it.
TEST(Drive, ACellThatShakesGetsNoQueueOfSeconds) {
  for (const unsigned seed : {41U, 42U, 43U}) {
    std::mt19937_64 draw(seed);
    std::normal_distribution<double> normal(0, 1);
    double mean = std::log(10e6 / 8);
    std::vector<double> rates;
    while (rates.size() < 3000) {
      if (rates.size() % 10 == 0)
        mean = std::clamp(mean + 0.2 * normal(draw), std::log(kSlowest), std::log(kFastest));
      rates.push_back(std::exp(mean + normal(draw) - 0.5));
    }
    auto options = cell(12);
    options.there.rate = stepwise(rates, 10ms);
    const auto there = run_bed(options).there;
    EXPECT_LT(there.percentile_ms(0.99), 600) << "seed " << seed;
    EXPECT_GT(there.bulk_share, 0.75) << "seed " << seed;
  }
}

// Those of make bench-wan, with stalls, from the first packet of a connection on.
TEST(Drive, UrgentMessagesAreHardlyLaterThanWithoutBulk) {
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    bench::Drive up(2 * seed), down(2 * seed + 1);
    auto options = cell(0);
    options.there.rate = [&](Duration at) { return up.at(at.count()) / 8; };
    options.back.rate = [&](Duration at) { return down.at(at.count()) / 8; };
    options.lasts = 21s;
    options.warm_up = 1s;
    const auto alone = run_bed(options).there;
    options.there.bulk_per_second = 12;
    const auto there = run_bed(options).there;
    EXPECT_LT(there.percentile_ms(0.5), alone.percentile_ms(0.5) + 6) << "seed " << seed;
    EXPECT_LT(there.percentile_ms(0.99), alone.percentile_ms(0.99) + 200) << "seed " << seed;
    EXPECT_GT(there.bulk_share, 0.74) << "seed " << seed;
  }
}

}  // namespace
}  // namespace connect_bridge::flow_test
