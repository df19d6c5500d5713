// A stream of pictures: their sizes, when one is a base, when half size is used.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/video/decoder.hpp"
#include "core/video/encoder.hpp"
#include "core/video/picture.hpp"
#include "unit/video/moving_scene.hpp"
#include "unit/video/seen.hpp"

namespace connect_bridge::video {
namespace {

// As a camera over grass sees it: 0.4 to 2.3 kB for each picture, from the worst to the best.
Scene lively() {
  return {320, 240, "mono8", 0, 7, 0, 3, 6};
}
constexpr PictureWish kWish{1200, 1U << 20};

class VideoStream : public testing::Test {
 protected:
  void SetUp() override {
    if (!available()) GTEST_SKIP() << "the build has no libvpx";
  }
  Bytes encode(const Scene& scene, const PictureWish& wish = kWish) {
    auto body = encoder_.encode(picture_of(scene, number_++), wish);
    EXPECT_TRUE(body);
    return body.value_or(Bytes{});
  }
  PictureFacts made(const Scene& scene, const PictureWish& wish = kWish) {
    return facts_of(encode(scene, wish)).value_or(PictureFacts{});
  }

  PictureEncoder encoder_;
  std::uint32_t number_ = 0;
};

TEST_F(VideoStream, HasPicturesOfTheWantedSize) {
  std::vector<Bytes> samples;
  for (std::uint32_t number = 0; number < 60; ++number)
    samples.push_back(picture_of(lively(), number));
  for (const std::uint32_t bytes : {800U, 1200U, 1800U}) {
    PictureEncoder encoder;
    std::vector<double> sizes;
    for (const Bytes& sample : samples) {
      const auto body = encoder.encode(sample, {bytes, 1U << 20});
      ASSERT_TRUE(body);
      sizes.push_back(static_cast<double>(body->size()) / bytes);
    }
    sizes.erase(sizes.begin(), sizes.begin() + 5);  // the encoder learns
    std::sort(sizes.begin(), sizes.end());
    EXPECT_GE(sizes[sizes.size() / 2], 0.85) << bytes;
    EXPECT_LE(sizes[sizes.size() / 2], 1.15) << bytes;
    EXPECT_LE(sizes[sizes.size() * 95 / 100], 1.3) << bytes;
  }
}

TEST_F(VideoStream, HasTheWantedSizeSoonAfterACut) {
  for (int i = 0; i < 20; ++i) encode(lively());
  Scene other = lively();
  other.place = 9;
  const Bytes cut = encode(other);
  EXPECT_FALSE(facts_of(cut).value().base);
  EXPECT_LE(cut.size(), 8 * kWish.bytes);
  encode(other);
  for (int i = 0; i < 5; ++i) EXPECT_LE(encode(other).size(), kWish.bytes * 3 / 2);
}

TEST_F(VideoStream, IsNoBetterThanTheEyeSeesAndNoWorseThanItBears) {
  EXPECT_EQ(made(lively(), {1U << 20, 1U << 20}).quantiser, 28);
  EXPECT_EQ(made(lively(), {100, 1U << 20}).quantiser, 52);
  EXPECT_EQ(made(lively(), {0, 1U << 20}).quantiser, 52);
}

TEST_F(VideoStream, IsTheSameEachTime) {
  PictureEncoder other;
  for (std::uint32_t number = 0; number < 10; ++number) {
    const auto again = other.encode(picture_of(lively(), number), kWish);
    EXPECT_EQ(encode(lively()), again.value_or(Bytes{}));
  }
}

TEST_F(VideoStream, BeginsWithABaseAndHasOneWhereItIsAskedFor) {
  EXPECT_TRUE(made(lively()).base);
  EXPECT_FALSE(made(lively()).base);
  EXPECT_TRUE(made(lively(), {20'000, 1U << 20, true}).base);
  EXPECT_FALSE(made(lively()).base);
}

TEST_F(VideoStream, HasABaseWhereSizeOrEncodingChange) {
  Scene scene{96, 64};
  for (const auto& [width, encoding] : {std::pair<std::uint32_t, const char*>{96, "rgb8"},
                                        {98, "rgb8"},
                                        {98, "bgr8"},
                                        {98, "bayer_rggb8"},
                                        {98, "bayer_bggr8"}}) {
    scene.width = width;
    scene.encoding = encoding;
    EXPECT_TRUE(made(scene).base) << width << encoding;
    EXPECT_FALSE(made(scene).base) << width << encoding;
  }
}

TEST_F(VideoStream, KeepsOnWhereTheStepChanges) {
  Scene scene{96, 64};
  PictureDecoder decoder;
  EXPECT_TRUE(decoder.decode(encode(scene), picture_of(scene, 0).size()));
  scene.padding = 8;
  const Bytes body = encode(scene);
  EXPECT_FALSE(facts_of(body).value().base);
  EXPECT_TRUE(decoder.decode(body, picture_of(scene, 1).size()));
}

TEST_F(VideoStream, HasABaseAfterASampleThatIsNoPicture) {
  for (const char* encoding : {"rgba8", "bgra8"}) {
    PictureEncoder encoder;
    Bytes sample = picture_of({96, 64, encoding}, 0);
    ASSERT_TRUE(encoder.encode(sample, kWish));
    EXPECT_FALSE(facts_of(encoder.encode(sample, kWish).value()).value().base);
    sample.back() = 254;  // the last pixel's alpha
    EXPECT_TRUE(is_picture(sample));
    EXPECT_FALSE(encoder.encode(sample, kWish));
    sample.back() = 255;
    EXPECT_TRUE(facts_of(encoder.encode(sample, kWish).value()).value().base);
  }
}

TEST_F(VideoStream, HasHalfSizeWhereTheWorstIsTooLargeAndComesBack) {
  const PictureWish wide{2000, 2000}, medium{280, 280}, narrow{250, 250};
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(made(lively(), wide).half);
  int pictures = 0;
  PictureFacts facts;
  while (!(facts = made(lively(), narrow)).half && pictures < 20) ++pictures;
  EXPECT_EQ(pictures, 2);  // one that is too large for a moment changes nothing
  EXPECT_TRUE(facts.base);
  for (int i = 0; i < 80; ++i) EXPECT_TRUE(made(lively(), narrow).half);
  // More room, but not what the whole size needs.
  for (int i = 0; i < 80; ++i) EXPECT_TRUE(made(lively(), medium).half);
  pictures = 0;
  while ((facts = made(lively(), wide)).half && pictures < 100) ++pictures;
  EXPECT_EQ(pictures, 59);
  EXPECT_TRUE(facts.base);
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(made(lively(), wide).half);
}

// Each try would cost a base and late pictures.
TEST_F(VideoStream, StaysAtHalfSizeWhereWholeOnesWouldTakeLonger) {
  const PictureWish narrow{250, 250}, longer{300, 2000}, wide{2000, 2000};
  ASSERT_TRUE(made(lively(), narrow).half);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(made(lively(), longer).half) << i;
  int pictures = 0;
  while (made(lively(), wide).half && pictures < 100) ++pictures;
  EXPECT_EQ(pictures, 59);
}

TEST_F(VideoStream, BeginsWithHalfSizeOnANarrowLink) {
  EXPECT_TRUE(made(lively(), {250, 250}).half);
  EXPECT_TRUE(made(lively(), {250, 250}).half);
}

TEST_F(VideoStream, StandsStillForFewBytes) {
  Scene still = lively();
  still.speed = 0;
  still.noise = 0;
  constexpr PictureWish kLarge{1U << 20, 1U << 20};
  for (int i = 0; i < 15; ++i) encode(still, kLarge);
  EXPECT_LE(encode(still, kLarge).size(), 1000U);
}

}  // namespace
}  // namespace connect_bridge::video
