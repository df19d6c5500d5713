// JPEGs of a CompressedImage there and back, of every subsampling; those that are no camera's, or
// damaged.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <tuple>

#ifdef CONNECT_VIDEO
#include <turbojpeg.h>
#endif

#include "core/base/byte_order.hpp"
#include "core/media/layouts.hpp"
#include "core/video/body.hpp"
#include "core/video/decoder.hpp"
#include "core/video/encoder.hpp"
#include "core/video/jpeg_head.hpp"
#include "core/video/picture.hpp"
#include "unit/media/samples.hpp"
#include "unit/video/moving_scene.hpp"
#include "unit/video/seen.hpp"
#include "unit/wire/vectors.hpp"

namespace connect_bridge::video {
namespace {

constexpr char kFormat[] = "rgb8; jpeg compressed bgr8";
constexpr char kType[] = "sensor_msgs/msg/CompressedImage";
constexpr PictureWish kGood{1U << 20, 1U << 20};

Bytes sample_of(ByteView jpeg) {
  return media::compressed_sample(jpeg, kFormat);
}

[[maybe_unused]] ByteView data_of(ByteView sample) {
  const auto place = media::compressed_data(sample).value();
  return sample.subspan(place.begin, place.bytes);
}

Bytes head_of(const media::TestJpeg& jpeg) {
  return media::jpeg_beginning(jpeg);
}

TEST(VideoJpeg, HasItsSizeInItsHead) {
  const auto color = jpeg_head(head_of({640, 480}));
  ASSERT_TRUE(color);
  EXPECT_EQ(color->size, (Size{640, 480}));
  EXPECT_FALSE(color->is_grey);
  EXPECT_TRUE(jpeg_head(head_of({33, 4000, 1, 0xc2})).value().is_grey);
  for (const std::uint8_t frame : {0xc3, 0xc5, 0xc9, 0xca, 0xd9, 0xda, 0xd0, 0x01})
    EXPECT_FALSE(jpeg_head(head_of({640, 480, 3, frame}))) << int{frame};
  EXPECT_FALSE(jpeg_head(head_of({640, 480, 4})));  // CMYK
  EXPECT_FALSE(jpeg_head(head_of({640, 480, 3, 0xc1, 12})));
  const Bytes whole = head_of({640, 480});
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(jpeg_head(ByteView(whole).first(size))) << size;
  Bytes longer = whole;
  ++longer[11];
  longer.push_back(0);
  EXPECT_FALSE(jpeg_head(longer));
  EXPECT_FALSE(jpeg_head(Bytes{0x89, 'P', 'N', 'G', 13, 10, 26, 10}));
}

TEST(VideoJpeg, HasNoEndlessHead) {
  Bytes jpeg{0xff, 0xd8};
  for (int i = 0; i < 64; ++i) jpeg.insert(jpeg.end(), {0xff, 0xe1, 0, 2});
  const Bytes frame = head_of({64, 64});
  jpeg.insert(jpeg.end(), frame.begin() + 8, frame.end());
  EXPECT_FALSE(jpeg_head(jpeg));
  jpeg.erase(jpeg.begin() + 2, jpeg.begin() + 6);
  EXPECT_TRUE(jpeg_head(jpeg));
}

TEST(VideoJpeg, IsAPictureWithinBounds) {
  const auto is_jpeg = [](std::uint32_t width, std::uint32_t height) {
    return is_picture(sample_of(head_of({width, height})));
  };
  EXPECT_TRUE(is_jpeg(32, 32));
  EXPECT_FALSE(is_jpeg(31, 32));
  EXPECT_FALSE(is_jpeg(32, 31));
  EXPECT_FALSE(is_jpeg(4097, 32));
  EXPECT_FALSE(is_jpeg(32, 4097));
  EXPECT_TRUE(is_jpeg(4096, 2047));
  EXPECT_FALSE(is_jpeg(4096, 2048));  // 16 MiB, and the prefix
  EXPECT_FALSE(is_jpeg(0, 0));
}

// A peer that gets the other kind closes the link.
TEST(VideoJpeg, IsAPictureOfItsTypeAlone) {
  const Bytes jpeg = sample_of(head_of({64, 64}));
  EXPECT_TRUE(is_picture(jpeg));
  EXPECT_EQ(picture_bytes(kType, jpeg),
            media::compressed_data(jpeg)->begin - 4 + 2 * 64 * 64 + 1024);
  EXPECT_EQ(picture_bytes("sensor_msgs/msg/Image", jpeg), 0U);
  EXPECT_EQ(picture_bytes("sensor_msgs/msg/PointCloud2", jpeg), 0U);
  const Bytes image = picture_of({64, 48}, 0);
  EXPECT_EQ(picture_bytes("sensor_msgs/msg/Image", image), image.size());
  EXPECT_EQ(picture_bytes(kType, image), 0U);
  EXPECT_TRUE(has_pictures(kType));
  EXPECT_FALSE(has_pictures("sensor_msgs/msg/PointCloud2"));
}

TEST(VideoJpeg, SampleAgreesWithItselfOrIsNone) {
  const Bytes sample = sample_of(head_of({64, 64}));
  for (std::size_t size = 0; size < sample.size(); ++size)
    EXPECT_FALSE(is_picture(ByteView(sample).first(size))) << size;
  Bytes longer = sample;
  longer.resize(sample.size() + 3);  // a middleware fills up the last four bytes
  EXPECT_TRUE(is_picture(longer));
  longer.push_back(0);
  EXPECT_FALSE(is_picture(longer));
}

#ifdef CONNECT_VIDEO

struct Rgb {
  Size size;
  Bytes values;
};
Rgb rgb_of(const Scene& scene, std::uint32_t number) {
  const Bytes sample = picture_of(scene, number);
  const auto image = media::image_layout(sample).value();
  return {{scene.width, scene.height}, {sample.begin() + image.data.begin, sample.end()}};
}

Bytes jpeg_of(const Rgb& picture, int sampling, bool progressive = false) {
  Bytes jpeg(tjBufSize(static_cast<int>(picture.size.width), static_cast<int>(picture.size.height),
                       TJSAMP_444));
  unsigned char* at = jpeg.data();
  unsigned long bytes = jpeg.size();
  const tjhandle codec = tjInitCompress();
  EXPECT_EQ(tjCompress2(codec, picture.values.data(), static_cast<int>(picture.size.width), 0,
                        static_cast<int>(picture.size.height), TJPF_RGB, &at, &bytes, sampling, 95,
                        TJFLAG_NOREALLOC | (progressive ? TJFLAG_PROGRESSIVE : 0)),
            0);
  tjDestroy(codec);
  jpeg.resize(bytes);
  return jpeg;
}

struct Seen {
  Rgb rgb;
  bool is_grey = false;
};
Seen seen_in(ByteView jpeg) {
  int width = 0, height = 0, sampling = 0, colours = 0;
  const tjhandle codec = tjInitDecompress();
  EXPECT_EQ(
      tjDecompressHeader3(codec, jpeg.data(), jpeg.size(), &width, &height, &sampling, &colours),
      0);
  Seen seen{{{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)},
             Bytes(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3)},
            colours == TJCS_GRAY};
  EXPECT_EQ(tjDecompress2(codec, jpeg.data(), jpeg.size(), seen.rgb.values.data(), width, 0, height,
                          TJPF_RGB, 0),
            0);
  tjDestroy(codec);
  return seen;
}

Grey luma_of(const Rgb& picture) {
  return video::luma_of(media::image_sample({picture.size.height, picture.size.width, "rgb8",
                                             3 * picture.size.width, false, picture.values}));
}

// The mean of each colour's difference.
double difference(const Rgb& a, const Rgb& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) sum += std::abs(a.values[i] - b.values[i]);
  return sum / static_cast<double>(a.values.size());
}

using Size2 = std::tuple<std::uint32_t, std::uint32_t>;
class VideoJpegs : public testing::TestWithParam<std::tuple<int, Size2, bool>> {
 protected:
  static Bytes sample(std::uint32_t number) {
    const auto& [sampling, size, progressive] = GetParam();
    const Scene scene{std::get<0>(size), std::get<1>(size), "rgb8", 0, 2, 0, 0};
    return sample_of(jpeg_of(rgb_of(scene, number), sampling, progressive));
  }
  static void expect_alike(const PictureWish& wish, double ssim_min, double difference_max) {
    PictureEncoder encoder;
    PictureDecoder decoder;
    for (std::uint32_t number = 0; number < 3; ++number) {
      const Bytes before = sample(number);
      const auto body = encoder.encode(before, wish);
      ASSERT_TRUE(body);
      const auto facts = facts_of(*body);
      ASSERT_TRUE(facts);
      EXPECT_TRUE(facts->jpeg);
      EXPECT_EQ(facts->base, number == 0);
      EXPECT_EQ(facts->half, wish.bytes_max == 0);
      const auto after = decoder.decode(*body, facts->raw_bytes);
      ASSERT_TRUE(after) << after.error().message;
      EXPECT_LE(after.value().size(), facts->raw_bytes);
      const std::size_t prefix = media::compressed_data(before).value().begin - 4;
      EXPECT_TRUE(std::equal(before.begin(), before.begin() + static_cast<long>(prefix),
                             after.value().begin()));
      const Seen was = seen_in(data_of(before)), is = seen_in(data_of(after.value()));
      ASSERT_EQ(is.rgb.size, was.rgb.size);
      EXPECT_EQ(is.is_grey, was.is_grey);
      EXPECT_GE(ssim(luma_of(was.rgb), luma_of(is.rgb)), ssim_min);
      EXPECT_LE(difference(was.rgb, is.rgb), difference_max);
    }
  }
};

TEST_P(VideoJpegs, ComeBackAlike) {
  expect_alike(kGood, 0.95, 3);
}
TEST_P(VideoJpegs, ComeBackAlikeFromHalfSize) {
  expect_alike({1U << 20, 0}, 0.9, 5);
}

INSTANTIATE_TEST_SUITE_P(Every, VideoJpegs,
                         testing::Combine(testing::Values(TJSAMP_444, TJSAMP_422, TJSAMP_420,
                                                          TJSAMP_GRAY, TJSAMP_440, TJSAMP_411),
                                          testing::Values(Size2{96, 64}, Size2{97, 67},
                                                          Size2{64, 35}, Size2{33, 64}),
                                          testing::Bool()));

class VideoOneJpeg : public testing::Test {
 protected:
  // What comes back of a sample with this JPEG.
  std::optional<Bytes> there_and_back(ByteView jpeg) {
    const auto body = encoder_.encode(sample_of(jpeg), kGood);
    if (!body) return std::nullopt;
    auto raw = decoder_.decode(*body, facts_of(*body).value().raw_bytes);
    EXPECT_TRUE(raw);
    return std::move(raw).value();
  }

  Rgb picture_ = rgb_of({97, 67, "rgb8"}, 0);
  PictureEncoder encoder_;
  PictureDecoder decoder_;
};

// Cameras lose bytes on their way, and a picture with a grey end is better than none.
TEST_F(VideoOneJpeg, ThatEndsTooEarlyIsAPicture) {
  const Bytes jpeg = jpeg_of(picture_, TJSAMP_422);
  const auto back = there_and_back(ByteView(jpeg).first(jpeg.size() * 3 / 4));
  ASSERT_TRUE(back);
  EXPECT_EQ(seen_in(data_of(*back)).rgb.size, picture_.size);
  Bytes longer = jpeg;
  longer.resize(jpeg.size() + 1000, 7);
  EXPECT_TRUE(there_and_back(longer));
}

TEST_F(VideoOneJpeg, ThatCannotBeDecodedIsNone) {
  const Bytes jpeg = jpeg_of(picture_, TJSAMP_420);
  Bytes damaged = jpeg;
  const std::string tables("\xff\xc4", 2);
  auto at = std::search(damaged.begin(), damaged.end(), tables.begin(), tables.end(),
                        [](auto a, char b) { return a == static_cast<std::uint8_t>(b); });
  ASSERT_NE(at, damaged.end());
  at[4] = 0x7f;  // a table that does not exist
  EXPECT_FALSE(there_and_back(damaged));
  // The next one begins anew.
  const auto body = encoder_.encode(sample_of(jpeg), kGood);
  EXPECT_TRUE(facts_of(body.value()).value().base);
}

TEST_F(VideoOneJpeg, WithoutYCbCrIsNone) {
  Bytes jpeg = jpeg_of(picture_, TJSAMP_444);
  // Adobe's segment says that the components are red, green and blue.
  const Bytes adobe{0xff, 0xee, 0, 14, 'A', 'd', 'o', 'b', 'e', 0, 100, 0, 0, 0, 0, 0};
  ASSERT_TRUE(there_and_back(jpeg));
  ASSERT_EQ(jpeg[3], 0xe0);  // JFIF's goes
  const std::size_t jfif = 2U + get_le<std::uint16_t>(Bytes{jpeg[5], jpeg[4]}, 0);
  jpeg.erase(jpeg.begin() + 2, jpeg.begin() + 2 + static_cast<long>(jfif));
  jpeg.insert(jpeg.begin() + 2, adobe.begin(), adobe.end());
  ASSERT_TRUE(is_picture(sample_of(jpeg)));
  EXPECT_FALSE(there_and_back(jpeg));
}

TEST_F(VideoOneJpeg, EachFlippedByteIsRefusedOrAPicture) {
  const Bytes jpeg = jpeg_of(rgb_of({40, 33, "rgb8"}, 0), TJSAMP_420);
  for (std::size_t at = 0; at < jpeg.size(); ++at) {
    Bytes damaged = jpeg;
    damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ 0xff);
    static_cast<void>(there_and_back(damaged));
  }
}

TEST_F(VideoOneJpeg, AnotherSizeOrColourIsABase) {
  ASSERT_TRUE(there_and_back(jpeg_of(picture_, TJSAMP_420)));
  const auto base_of = [&](const Rgb& picture, int sampling) {
    const auto body = encoder_.encode(sample_of(jpeg_of(picture, sampling)), kGood);
    return facts_of(body.value()).value().base;
  };
  EXPECT_FALSE(base_of(picture_, TJSAMP_444));
  EXPECT_TRUE(base_of(picture_, TJSAMP_GRAY));
  EXPECT_TRUE(base_of(rgb_of({64, 64, "rgb8"}, 0), TJSAMP_GRAY));
}

class VideoHostileJpeg : public VideoOneJpeg {
 protected:
  void SetUp() override {
    body_ = encoder_.encode(sample_of(jpeg_of(picture_, TJSAMP_420)), kGood).value_or(Bytes{});
    raw_bytes_ = facts_of(body_).value_or(PictureFacts{}).raw_bytes;
  }
  [[nodiscard]] Bytes with(std::size_t at, std::uint8_t value) const {
    Bytes body = body_;
    body[at] = value;
    return body;
  }
  void expect_refused(ByteView body) {
    EXPECT_FALSE(facts_of(body));
    EXPECT_FALSE(decoder_.decode(body, raw_bytes_));
  }

  Bytes body_;
  std::size_t raw_bytes_ = 0;
};

TEST_F(VideoHostileJpeg, HeadIsChecked) {
  ASSERT_TRUE(decoder_.decode(body_, raw_bytes_));
  EXPECT_EQ(body_[1], 5);
  expect_refused(with(1, 1));    // an Image, and the prefix is none
  expect_refused(with(1, 9));    // grey, and no JPEG
  expect_refused(with(1, 21));   // a flag that nobody knows
  expect_refused(with(8, 31));   // width
  expect_refused(with(8, 98));   // another one than the frame's
  expect_refused(with(10, 68));  // height
  expect_refused(with(9, 0x40));
  expect_refused(with(4, 255));  // bytes of the prefix
  expect_refused(with(4, static_cast<std::uint8_t>(body_[4] - 1)));
  expect_refused(with(4, static_cast<std::uint8_t>(body_[4] + 1)));
  expect_refused(ByteView(body_).first(kBodyHeadBytes + 3));
  EXPECT_FALSE(decoder_.decode(body_, raw_bytes_ + 1));
  EXPECT_TRUE(decoder_.decode(with(1, 13), raw_bytes_));  // grey: the same frame
}

TEST_F(VideoHostileJpeg, EachTruncationAndFlippedByteIsRefusedOrAPicture) {
  const auto expect_sane = [&](ByteView body) {
    const auto raw = decoder_.decode(body, raw_bytes_);
    if (!raw) return;
    EXPECT_LE(raw.value().size(), raw_bytes_);
    EXPECT_TRUE(is_picture(raw.value()));
  };
  for (std::size_t at = 0; at < body_.size(); ++at) {
    expect_sane(ByteView(body_).first(at));
    expect_sane(with(at, static_cast<std::uint8_t>(body_[at] ^ 0xff)));
  }
}

TEST(VideoJpeg, IsMadeAsTheVectorsSay) {
  int seen = 0;
  for (const auto& stream : read_vectors("pictures.json")) {
    if (stream.at("encoding") != "jpeg") continue;
    PictureDecoder decoder;
    for (const auto& picture : stream.at("pictures")) {
      const Bytes body = from_hex(picture.at("body").get<std::string>());
      const auto raw = decoder.decode(body, picture.at("raw_bytes").get<std::size_t>());
      ASSERT_TRUE(raw) << raw.error().message;
      const Bytes prefix = from_hex(picture.at("prefix").get<std::string>());
      ASSERT_GT(raw.value().size(), prefix.size());
      EXPECT_TRUE(std::equal(prefix.begin(), prefix.end(), raw.value().begin()));
      const Rgb rgb = seen_in(data_of(raw.value())).rgb;
      EXPECT_EQ(rgb.size, (Size{picture.at("width"), picture.at("height")}));
      for (std::size_t colour = 0; colour < 3; ++colour) {
        double sum = 0;
        for (std::size_t i = colour; i < rgb.values.size(); i += 3) sum += rgb.values[i];
        EXPECT_NEAR(3 * sum / static_cast<double>(rgb.values.size()),
                    picture.at("mean_rgb").at(colour).get<double>(), 0.5);
      }
      ++seen;
    }
  }
  EXPECT_EQ(seen, 4);
}

#else

TEST(VideoJpeg, IsNeverEncodedWithoutTheLibrary) {
  const Bytes sample = sample_of(head_of({64, 64}));
  ASSERT_TRUE(is_picture(sample));
  EXPECT_FALSE(PictureEncoder().encode(sample, kGood));
}

#endif

}  // namespace
}  // namespace connect_bridge::video
