// Pictures there and back, of every encoding; which samples may be pictures.
#include "core/video/picture.hpp"

#include <gtest/gtest.h>

#include <string>
#include <tuple>

#include "core/video/body.hpp"
#include "core/video/decoder.hpp"
#include "core/video/encoder.hpp"
#include "unit/media/samples.hpp"
#include "unit/video/moving_scene.hpp"
#include "unit/video/seen.hpp"
#include "unit/wire/vectors.hpp"

namespace connect_bridge::video {
namespace {

constexpr PictureWish kGood{1U << 20, 1U << 20};
constexpr PictureWish kHalfSize{1U << 20, 0};

struct Parts {
  Bytes prefix;
  Bytes values;   // of all rows, without their padding
  Bytes padding;  // of all rows
};
Parts parts_of(ByteView sample, std::size_t padding) {
  const auto image = media::image_layout(sample).value();
  Parts parts;
  parts.prefix.assign(sample.begin(), sample.begin() + image.data.begin);
  for (std::size_t at = image.data.begin; at < sample.size(); at += image.step) {
    const ByteView row = sample.subspan(at, image.step);
    const auto end = row.end() - static_cast<std::ptrdiff_t>(padding);
    parts.values.insert(parts.values.end(), row.begin(), end);
    parts.padding.insert(parts.padding.end(), end, row.end());
  }
  return parts;
}

double mean_difference(const Bytes& a, const Bytes& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum / static_cast<double>(a.size());
}

using Size2 = std::tuple<std::uint32_t, std::uint32_t>;
class VideoEncodings
    : public testing::TestWithParam<std::tuple<const char*, Size2, std::uint32_t>> {
 protected:
  void SetUp() override {
    if (!available()) GTEST_SKIP() << "the build has no libvpx";
  }
  static Scene scene() {
    const auto& [encoding, size, padding] = GetParam();
    return {std::get<0>(size), std::get<1>(size), encoding, padding, 2, 0, 0};
  }
  // A base and two deltas; the last one and its sample.
  static void expect_alike(const PictureWish& wish, double ssim_min, double difference_max) {
    PictureEncoder encoder;
    PictureDecoder decoder;
    for (std::uint32_t number = 0; number < 3; ++number) {
      const Bytes sample = picture_of(scene(), number);
      ASSERT_TRUE(is_picture(sample));
      const auto body = encoder.encode(sample, wish);
      ASSERT_TRUE(body);
      const auto facts = facts_of(*body);
      ASSERT_TRUE(facts);
      EXPECT_EQ(facts->base, number == 0);
      EXPECT_EQ(facts->half, wish.bytes_max == 0);
      EXPECT_EQ(facts->quantiser, 28);
      EXPECT_EQ(facts->raw_bytes, sample.size());
      const auto back = decoder.decode(*body, sample.size());
      ASSERT_TRUE(back) << back.error().message;
      ASSERT_EQ(back.value().size(), sample.size());
      const Parts before = parts_of(sample, scene().padding);
      const Parts after = parts_of(back.value(), scene().padding);
      EXPECT_EQ(after.prefix, before.prefix);
      EXPECT_EQ(after.padding, Bytes(before.padding.size()));
      EXPECT_LE(mean_difference(after.values, before.values), difference_max);
      EXPECT_GE(ssim(luma_of(sample), luma_of(back.value())), ssim_min);
    }
  }
};

TEST_P(VideoEncodings, ComeBackAlike) {
  expect_alike(kGood, 0.95, 3);
}
TEST_P(VideoEncodings, ComeBackAlikeFromHalfSize) {
  expect_alike(kHalfSize, 0.9, 5);
}

const auto kEncodings = testing::Values("rgb8", "bgr8", "rgba8", "bgra8", "mono8", "uyvy", "yuv422",
                                        "yuyv", "yuv422_yuy2", "nv12", "nv21", "nv24",
                                        "bayer_rggb8", "bayer_bggr8", "bayer_gbrg8", "bayer_grbg8");
INSTANTIATE_TEST_SUITE_P(Every, VideoEncodings,
                         testing::Combine(kEncodings,
                                          testing::Values(Size2{96, 64}, Size2{97, 67},
                                                          Size2{64, 35}, Size2{33, 64}),
                                          testing::Values(0U, 5U)));

TEST(VideoPicture, IsOnlyWhatACameraSees) {
  for (const char* encoding : {"8UC1", "8UC3", "8UC4", "8SC1", "mono16", "16UC1", "32FC1", "rgb16",
                               "bgra16", "bayer_rggb16", "jpeg", "", "rgb8 "}) {
    const Bytes sample = media::image_sample({64, 64, encoding, 64, false, Bytes(64 * 64)});
    EXPECT_FALSE(is_picture(sample)) << encoding;
    EXPECT_FALSE(PictureEncoder().encode(sample, kGood)) << encoding;
  }
  EXPECT_FALSE(is_picture(Bytes{}));
  EXPECT_FALSE(is_picture(Bytes(1000, 1)));
}

TEST(VideoPicture, HasBounds) {
  const auto grey = [](std::uint32_t width, std::uint32_t height, std::uint32_t step) {
    return media::image_sample(
        {height, width, "mono8", step, false, Bytes(std::size_t{step} * height)});
  };
  EXPECT_TRUE(is_picture(grey(32, 32, 32)));
  EXPECT_FALSE(is_picture(grey(31, 32, 32)));
  EXPECT_FALSE(is_picture(grey(32, 31, 32)));
  EXPECT_TRUE(is_picture(grey(4096, 32, 4096)));
  EXPECT_FALSE(is_picture(grey(4097, 32, 4097)));
  EXPECT_FALSE(is_picture(grey(32, 4097, 32)));
  EXPECT_TRUE(is_picture(grey(4096, 4000, 4096)));
  EXPECT_FALSE(is_picture(grey(4096, 4096, 4096)));  // 16 MiB, and what is before
  EXPECT_FALSE(is_picture(grey(64, 64, 63)));
}

TEST(VideoPicture, HasNoPaddingOfTheMiddleware) {
  if (!available()) GTEST_SKIP() << "the build has no libvpx";
  Bytes sample = picture_of({64, 48}, 0);
  const std::size_t bytes = sample.size();
  sample.resize(bytes + 3);
  const auto body = PictureEncoder().encode(sample, {4000, 8000});
  ASSERT_TRUE(body);
  EXPECT_EQ(facts_of(*body)->raw_bytes, bytes);
}

TEST(VideoPicture, HasAsManyBytesAsItsSizeSays) {
  Bytes sample = picture_of({64, 48}, 0);
  EXPECT_TRUE(is_picture(sample));
  // A middleware fills up the last four bytes.
  sample.resize(sample.size() + 3);
  EXPECT_TRUE(is_picture(sample));
  sample.push_back(0);
  EXPECT_FALSE(is_picture(sample));
  for (const char* encoding : {"nv12", "nv24", "mono8"}) {
    const std::uint32_t row = 64;
    EXPECT_EQ(is_picture(media::image_sample({64, 64, encoding, row, false, Bytes(64 * 96)})),
              std::string(encoding) == "nv12");
    EXPECT_EQ(is_picture(media::image_sample({64, 64, encoding, row, false, Bytes(64 * 192)})),
              std::string(encoding) == "nv24");
  }
}

TEST(VideoPicture, IsReadAsTheVectorsSay) {
  if (!available()) GTEST_SKIP() << "the build has no libvpx";
  for (const auto& stream : read_vectors("pictures.json")) {
    if (stream.at("encoding") == "jpeg") continue;  // jpeg_test.cpp
    PictureDecoder decoder;
    for (const auto& picture : stream.at("pictures")) {
      const Bytes raw = from_hex(picture.at("raw").get<std::string>());
      const auto back = decoder.decode(from_hex(picture.at("body").get<std::string>()), raw.size());
      ASSERT_TRUE(back) << back.error().message;
      EXPECT_EQ(back.value(), raw) << stream.at("encoding");
    }
  }
}

TEST(VideoPicture, IsRefusedWithoutLibvpx) {
  if (available()) GTEST_SKIP() << "the build has libvpx";
  const Bytes sample = picture_of({64, 48}, 0);
  EXPECT_FALSE(PictureEncoder().encode(sample, kGood));
  PictureBody body;
  const auto read = read_sample(sample).value();
  body.base = true;
  body.prefix = read.prefix;
  const Bytes frame{0x10, 0, 0, 0x9d, 0x01, 0x2a, 64, 0, 48, 0, 0};
  body.frame = frame;
  ASSERT_TRUE(facts_of(write_body(body)));
  EXPECT_FALSE(PictureDecoder().decode(write_body(body), sample.size()));
}

}  // namespace
}  // namespace connect_bridge::video
