#include "core/topics/cloud_form.hpp"

#include <gtest/gtest.h>

#include <map>

namespace connect_bridge {
namespace {

// Clouds of a million bytes, ten a second.
struct Sweeps {
  std::uint32_t next(double rate) {
    now += std::chrono::milliseconds(interval_ms);
    subject.came(now);
    return subject.choose({rate, is_shown, exact_bytes, error_um,
                           [&](std::uint32_t step) {
                             const auto known = sizes.find(step);
                             return known == sizes.end() ? std::nullopt
                                                         : std::optional(known->second);
                           }},
                          now);
  }
  std::uint32_t after(int clouds, double rate) {
    std::uint32_t step = 0;
    for (int i = 0; i < clouds; ++i) step = next(rate);
    return step;
  }

  int interval_ms = 100;
  bool is_shown = true;
  double exact_bytes = 1e6;
  std::uint32_t error_um = 5000;
  std::map<std::uint32_t, double> sizes;
  TimePoint now{std::chrono::seconds(1)};
  CloudForm subject;
};

TEST(CloudForm, FiveASecondAreEnoughToStayExact) {
  EXPECT_EQ(Sweeps{}.after(100, 5e6), 0U);
  EXPECT_GT(Sweeps{}.after(100, 4.9e6), 0U);
}

TEST(CloudForm, HalfOfWhatIsPublishedIsEnough) {
  Sweeps s;
  s.interval_ms = 1000;
  EXPECT_EQ(s.after(20, 0.5e6), 0U);
  EXPECT_GT(s.after(20, 0.49e6), 0U);
}

TEST(CloudForm, NothingIsRoundedBeforeTheRatesAreKnown) {
  Sweeps s;
  EXPECT_EQ(s.next(1000), 0U);  // one cloud says nothing of how often they come
  EXPECT_EQ(s.next(0), 0U);
  EXPECT_GT(s.next(1000), 0U);
}

// A new connection assumes little before it has sent much.
TEST(CloudForm, ARateThatIsOnlyAssumedMakesNoneLossy) {
  Sweeps s;
  s.is_shown = false;
  EXPECT_EQ(s.after(100, 1000), 0U);
  s.is_shown = true;
  EXPECT_GT(s.after(1, 1000), 0U);
  s.is_shown = false;  // small ones leave at once
  EXPECT_GT(s.after(40, 8e6), 0U);
  EXPECT_EQ(s.after(20, 8e6), 0U);
}

// 10 a second of 400, 333, 278, 231 kB need 4, 3.3, 2.8, 2.3 MB/s.
TEST(CloudForm, TheFinestStepThatFitsIsTaken) {
  EXPECT_EQ(Sweeps{}.after(3, 4.9e6), 2000U);
  EXPECT_EQ(Sweeps{}.after(3, 4e6), 5000U);
  EXPECT_EQ(Sweeps{}.after(3, 3e6), 10'000U);
  EXPECT_EQ(Sweeps{}.after(3, 0.1e6), 10'000U);
}

TEST(CloudForm, SizesThatAreKnownCount) {
  Sweeps s;
  s.sizes[1000] = 350'000;
  EXPECT_EQ(s.after(3, 4.5e6), 1000U);
}

TEST(CloudForm, NoPointMovesFartherThanTheRuleSays) {
  Sweeps s;
  s.error_um = 100;
  EXPECT_EQ(s.after(10, 0.1e6), 200U);
  Sweeps coarse;
  coarse.error_um = 50'000;
  EXPECT_EQ(coarse.after(10, 0.1e6), 100'000U);
  Sweeps fits;
  fits.error_um = 50'000;
  EXPECT_EQ(fits.after(10, 3e6), 10'000U);
}

TEST(CloudForm, AFinerStepMustFitWell) {
  Sweeps s;
  EXPECT_EQ(s.after(3, 4e6), 5000U);
  EXPECT_EQ(s.after(10, 4.3e6), 5000U);  // 2 mm would just fit
  EXPECT_EQ(s.after(10, 4.99e6), 5000U);
  s.sizes[2000] = 300'000;
  EXPECT_EQ(s.after(10, 4.99e6), 2000U);
}

TEST(CloudForm, ExactAgainWhenItWouldFitHalfMoreForFiveSeconds) {
  Sweeps s;
  ASSERT_GT(s.after(10, 1e6), 0U);
  EXPECT_GT(s.after(200, 7.4e6), 0U);
  EXPECT_GT(s.after(50, 7.6e6), 0U);
  EXPECT_GT(s.after(1, 7.4e6), 0U);  // from the beginning
  EXPECT_GT(s.after(50, 7.6e6), 0U);
  EXPECT_EQ(s.after(1, 7.6e6), 0U);
  EXPECT_EQ(s.after(50, 5e6), 0U);
}

TEST(CloudForm, APauseIsNoRate) {
  Sweeps s;
  s.after(10, 10e6);
  s.now += std::chrono::minutes(5);
  EXPECT_EQ(s.after(10, 5.1e6), 0U);
}

}  // namespace
}  // namespace connect_bridge
