// The choice of the quantiser by the sizes of the pictures before.
#include "core/video/quantiser.hpp"

#include <gtest/gtest.h>

namespace connect_bridge::video {
namespace {

constexpr std::uint64_t kPixels = 640 * 480;
constexpr auto kBest = QuantiserControl::kBest;
constexpr auto kWorst = QuantiserControl::kWorst;

TEST(VideoQuantiser, IsFinerForMoreBytesWithinItsBounds) {
  const QuantiserControl control(kPixels);
  EXPECT_EQ(control.quantiser(true, 1e9, 0), kBest);
  EXPECT_EQ(control.quantiser(true, 0, 0), kWorst);
  std::uint8_t last = kWorst;
  for (double bytes = 1000; bytes < 200'000; bytes *= 1.1) {
    const auto found = control.quantiser(true, bytes, 0);
    EXPECT_LE(found, last);
    last = found;
  }
  EXPECT_EQ(last, kBest);
}

TEST(VideoQuantiser, ExpectsTheSizeItHasSeen) {
  QuantiserControl control(kPixels);
  control.made(true, 40, 30'000, 0);
  EXPECT_NEAR(control.bytes_at(true, 40), 30'000, 1);
  EXPECT_EQ(control.quantiser(true, 30'000, 0), 40);
  EXPECT_GT(control.quantiser(true, 25'000, 0), 40);
  EXPECT_LT(control.quantiser(true, 35'000, 0), 40);
}

TEST(VideoQuantiser, FollowsUpwardsFasterThanDownwards) {
  QuantiserControl up(kPixels), down(kPixels);
  for (int i = 0; i < 30; ++i) up.made(false, 40, 8000, 5), down.made(false, 40, 8000, 5);
  EXPECT_NEAR(up.bytes_at(false, 40), 8000, 10);
  up.made(false, 40, 16'000, 5);
  down.made(false, 40, 4000, 5);
  EXPECT_NEAR(up.bytes_at(false, 40), 8000 * 1.625, 10);    // 2 to the power of 0.7
  EXPECT_NEAR(down.bytes_at(false, 40), 8000 / 1.275, 10);  // 2 to the power of 0.35
}

TEST(VideoQuantiser, IsCoarserWhereThePictureDiffersMore) {
  QuantiserControl control(kPixels);
  for (int i = 0; i < 30; ++i) control.made(false, 40, 8000, 5);
  EXPECT_EQ(control.quantiser(false, 8000, 5), 40);
  EXPECT_EQ(control.quantiser(false, 8000, 2), 40);
  EXPECT_GT(control.quantiser(false, 8000, 10), 43);
  EXPECT_EQ(control.quantiser(true, 8000, 10), control.quantiser(true, 8000, 5));
}

TEST(VideoQuantiser, TakesALargeDifferenceForNoNewComplexity) {
  QuantiserControl control(kPixels);
  for (int i = 0; i < 30; ++i) control.made(false, 40, 8000, 5);
  control.made(false, 40, 8000 * 1.741, 10);  // 2 to the power of 0.8, as the difference says
  EXPECT_NEAR(control.bytes_at(false, 40), 8000, 10);
}

TEST(VideoQuantiser, ExpectsADeltaToMakeUpForACoarserPicture) {
  QuantiserControl after_coarse(kPixels), after_fine(kPixels);
  for (int i = 0; i < 30; ++i) after_fine.made(false, 32, 8000, 5);
  after_coarse = after_fine;
  after_coarse.made(true, 52, 8000, 5);
  EXPECT_GT(after_coarse.quantiser(false, 8000, 5), after_fine.quantiser(false, 8000, 5));
}

}  // namespace
}  // namespace connect_bridge::video
