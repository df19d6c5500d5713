#include "core/media/planes.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/media/layouts.hpp"
#include "core/media/sample_codec.hpp"
#include "unit/media/samples.hpp"

namespace connect_bridge::media {
namespace {

constexpr Compression kPlanes{Codec::kPlanes, 1};

// Bytes of a row, and rows for each row of the picture in halves.
struct Encoding {
  std::string_view name;
  std::uint32_t pixel_bytes = 1;
  std::uint32_t half_rows = 2;
};

// A scene that changes slowly, with noise: a camera's bytes.
Bytes scene(std::size_t size, std::uint32_t row_bytes) {
  std::mt19937 random{7};
  Bytes data(size);
  for (std::size_t i = 0; i < size; ++i)
    data[i] = static_cast<std::uint8_t>(i % row_bytes / 3 + i / row_bytes + random() % 3);
  return data;
}

TestImage picture(const Encoding& encoding, std::uint32_t width, std::uint32_t height,
                  std::uint32_t padding) {
  TestImage image{height, width, encoding.name, width * encoding.pixel_bytes + padding, false, {}};
  const std::uint32_t rows = (height * encoding.half_rows + 1) / 2;
  image.data = scene(std::size_t{rows} * image.step, image.step);
  return image;
}

Bytes there_and_back(const Bytes& sample, const Compression& how = kPlanes) {
  const auto body = encode_sample(sample, how);
  if (!body) return sample;  // it goes as it is
  EXPECT_LT(body->size(), sample.size());
  const auto back = decode_sample(*body, how.codec, sample.size());
  EXPECT_TRUE(back.ok()) << (back.ok() ? "" : back.error().message);
  return back.ok() ? back.value() : Bytes{};
}

class EveryEncoding : public testing::TestWithParam<Encoding> {};
INSTANTIATE_TEST_SUITE_P(
    Media, EveryEncoding,
    testing::Values(Encoding{"rgb8", 3}, Encoding{"bgr8", 3}, Encoding{"rgba8", 4},
                    Encoding{"bgra8", 4}, Encoding{"rgb16", 6}, Encoding{"bgr16", 6},
                    Encoding{"rgba16", 8}, Encoding{"bgra16", 8}, Encoding{"mono8"},
                    Encoding{"mono16", 2}, Encoding{"bayer_rggb8"}, Encoding{"bayer_bggr8"},
                    Encoding{"bayer_gbrg8"}, Encoding{"bayer_grbg8"}, Encoding{"bayer_rggb16", 2},
                    Encoding{"bayer_bggr16", 2}, Encoding{"bayer_gbrg16", 2},
                    Encoding{"bayer_grbg16", 2}, Encoding{"yuv422", 2}, Encoding{"uyvy", 2},
                    Encoding{"yuv422_yuy2", 2}, Encoding{"yuyv", 2}, Encoding{"nv12", 1, 3},
                    Encoding{"nv21", 1, 3}, Encoding{"nv24", 1, 6}, Encoding{"8UC1"},
                    Encoding{"8UC2", 2}, Encoding{"8UC3", 3}, Encoding{"8SC1"}, Encoding{"8UC4", 4},
                    Encoding{"16UC1", 2}, Encoding{"16SC2", 4}, Encoding{"32SC1", 4},
                    Encoding{"32FC1", 4}, Encoding{"32FC3", 12}, Encoding{"64FC1", 8}));

TEST_P(EveryEncoding, ReturnsAllBytesWhateverSizeAndPadding) {
  for (const std::uint32_t width : {1U, 2U, 7U, 64U, 97U})
    for (const std::uint32_t height : {1U, 2U, 5U, 48U})
      for (const std::uint32_t padding : {0U, 1U, 16U}) {
        TestImage image = picture(GetParam(), width, height, padding);
        for (const bool big_endian : {false, true}) {
          image.big_endian = big_endian;
          const Bytes sample = image_sample(image);
          ASSERT_TRUE(image_columns(sample)) << width << "x" << height << " " << padding;
          EXPECT_EQ(there_and_back(sample), sample) << width << "x" << height << " " << padding;
        }
      }
}

// Every byte belongs to one column, so nothing of a row's padding is lost.
TEST_P(EveryEncoding, ColumnsCoverEachByteOnce) {
  for (const std::uint32_t width : {1U, 6U, 33U}) {
    const Bytes sample = image_sample(picture(GetParam(), width, 9, 5));
    const auto columns = image_columns(sample);
    ASSERT_TRUE(columns);
    Bytes covered(sample.size());
    for (const Column& column : *columns)
      for (std::uint32_t row = 0; row < column.rows; ++row)
        for (std::uint32_t i = 0; i < column.count; ++i)
          for (std::uint32_t byte = 0; byte < column.width; ++byte)
            ++covered[column.begin + row * column.row_stride + i * column.stride + byte];
    EXPECT_EQ(covered, Bytes(sample.size(), 1));
  }
}

TEST(MediaPlanes, ShrinkACameraPictureMoreThanZstd) {
  std::mt19937 random{3};
  TestImage image{120, 160, "rgb8", 480, false, Bytes(120 * 480)};
  for (std::size_t i = 0; i < 120UL * 160; ++i) {
    const std::size_t grey = i % 160 / 2 + i / 160 + random() % 4;
    for (std::size_t c = 0; c < 3; ++c)
      image.data[3 * i + c] = static_cast<std::uint8_t>(grey + 20 * c + random() % 3);
  }
  const Bytes sample = image_sample(image);
  const auto planes = encode_sample(sample, kPlanes);
  const auto zstd = encode_sample(sample, {Codec::kZstd, 1});
  ASSERT_TRUE(planes);
  EXPECT_LT(2 * planes->size(), zstd ? zstd->size() : sample.size());
}

// A mask's colours repeat, and differences hide that.
TEST(MediaPlanes, LeaveADrawingToZstd) {
  TestImage image{200, 300, "rgb8", 900, false, Bytes(200 * 900)};
  std::mt19937 random{3};
  Bytes tile(900);
  for (auto& byte : tile) byte = static_cast<std::uint8_t>(random());
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = tile[i % tile.size()];
  const Bytes sample = image_sample(image);
  const auto planes = encode_sample(sample, kPlanes);
  const auto zstd = encode_sample(sample, {Codec::kZstd, 1});
  ASSERT_TRUE(planes && zstd);
  EXPECT_LT(planes->size(), zstd->size() + 64);
  EXPECT_EQ(there_and_back(sample), sample);
}

TEST(MediaPlanes, DistancesAsFloatsOfMillimetresAreRanks) {
  TestImage image{60, 80, "32FC1", 320, false, Bytes(60 * 320)};
  for (std::size_t i = 0; i < 60UL * 80; ++i)
    set_float(static_cast<float>(i * 7 % 900) * 0.001F, image.data, 4 * i);
  const Bytes sample = image_sample(image);
  const auto body = encode_sample(sample, kPlanes);
  ASSERT_TRUE(body);
  EXPECT_LT(body->size(), sample.size() / 3);
  EXPECT_EQ(there_and_back(sample), sample);
}

TEST(MediaPlanes, SpecialFloatsStay) {
  TestImage image{4, 2000, "32FC1", 8000, false, Bytes(4 * 8000)};
  std::mt19937 random{5};
  for (std::size_t i = 0; i < 8000; ++i)
    set_le(static_cast<std::uint32_t>(random()), image.data, 4 * i);
  for (std::size_t i = 0; i < 8000; i += 7)
    set_le(static_cast<std::uint32_t>(0x7fc00001U + i), image.data, 4 * i);
  const Bytes sample = image_sample(image);
  EXPECT_EQ(there_and_back(sample), sample);
}

TEST(MediaPlanes, WhatDisagreesWithItselfIsOpaque) {
  const TestImage good{4, 6, "rgb8", 20, false, Bytes(80, 9)};
  ASSERT_TRUE(image_columns(image_sample(good)));
  const auto refused = [&](auto change) {
    TestImage image = good;
    change(image);
    const Bytes sample = image_sample(image);
    EXPECT_FALSE(image_columns(sample));
    EXPECT_EQ(there_and_back(sample), sample);
  };
  refused([](TestImage& i) { i.step = 17; });
  refused([](TestImage& i) { i.height = 5; });
  refused([](TestImage& i) { i.width = 7; });
  refused([](TestImage& i) { i.width = 0xffffffff; });
  refused([](TestImage& i) { i.height = 0x80000000; });
  refused([](TestImage& i) { i.step = 0; });
  refused([](TestImage& i) { i.encoding = "rgb9"; });
  refused([](TestImage& i) { i.encoding = "8UC300"; });
  refused([](TestImage& i) { i.encoding = ""; });
  refused([](TestImage& i) { i.data.pop_back(); });
  Bytes sample = image_sample(good);
  for (std::size_t size = 0; size < sample.size(); ++size)
    EXPECT_FALSE(image_columns(ByteView(sample).first(size))) << size;
  sample[1] = 0;  // big-endian CDR
  EXPECT_FALSE(image_columns(sample));
}

// A middleware may fill a sample up to a multiple of four.
TEST(MediaPlanes, TheLastBytesOfASampleStay) {
  Bytes sample = image_sample({32, 33, "mono8", 33, false, scene(32 * 33, 33)});
  for (int i = 0; i < 3; ++i) {
    sample.push_back(static_cast<std::uint8_t>(7 + i));
    ASSERT_TRUE(image_columns(sample));
    EXPECT_EQ(there_and_back(sample), sample);
  }
  sample.push_back(0);
  EXPECT_FALSE(image_columns(sample));
}

// ---- hostile bodies

struct Hostile : testing::Test {
  const Bytes sample = image_sample({32, 40, "rgb8", 120, false, scene(32 * 120, 120)});
  const Bytes body = encode_sample(sample, kPlanes).value_or(Bytes{});
  [[nodiscard]] bool decodes(const Bytes& changed, std::size_t raw_bytes) const {
    return decode_sample(changed, Codec::kPlanes, raw_bytes).ok();
  }
  // A change of the second column: columns have 32 bytes, behind two of the head.
  [[nodiscard]] bool decodes_with(std::size_t at, std::uint32_t value) const {
    Bytes changed = body;
    set_le(value, changed, 2 + 32 + at);
    return decodes(changed, sample.size());
  }
};

TEST_F(Hostile, OnlyTheAnnouncedSizeIsDecoded) {
  ASSERT_TRUE(decodes(body, sample.size()));
  EXPECT_FALSE(decodes(body, sample.size() - 1));
  EXPECT_FALSE(decodes(body, sample.size() + 1));
  EXPECT_FALSE(decodes(body, 0));
  for (std::size_t size = 0; size < body.size(); ++size)
    EXPECT_FALSE(decodes(Bytes(body.begin(), body.begin() + static_cast<std::ptrdiff_t>(size)),
                         sample.size()));
}

TEST_F(Hostile, ColumnsStayWithinTheSample) {
  EXPECT_FALSE(decodes_with(0, 0xffffffff));  // begin
  EXPECT_FALSE(decodes_with(4, 0));           // rows
  EXPECT_FALSE(decodes_with(4, 0xffffffff));
  EXPECT_FALSE(decodes_with(8, 0x7fffffff));  // distance of rows
  EXPECT_FALSE(decodes_with(12, 0));          // count
  EXPECT_FALSE(decodes_with(12, 0x10000));
  EXPECT_FALSE(decodes_with(16, 0x0101ffff));  // stride
  EXPECT_FALSE(decodes_with(24, 1));           // a table of none
  EXPECT_FALSE(decodes_with(28, 1));           // a list of none
}

TEST_F(Hostile, FormsThatDoNotExistAreRefused) {
  const auto byte = [&](std::size_t at, std::uint8_t value) {
    Bytes changed = body;
    changed[at] = value;
    return decodes(changed, sample.size());
  };
  EXPECT_FALSE(byte(0, 2));  // version
  EXPECT_FALSE(byte(1, 0));  // columns
  EXPECT_FALSE(byte(1, 255));
  EXPECT_FALSE(byte(2 + 32 + 18, 3));  // kind
  EXPECT_FALSE(byte(2 + 32 + 18, 2));  // steps are not exact
  EXPECT_FALSE(byte(2 + 32 + 19, 3));  // width
  EXPECT_FALSE(byte(2 + 32 + 20, 0));  // planes
  EXPECT_FALSE(byte(2 + 32 + 20, 2));
  EXPECT_FALSE(byte(2 + 32 + 22, 4));  // flags
  EXPECT_FALSE(byte(2 + 32 + 23, 1));
}

// The first column has no key yet, or one of another size.
TEST_F(Hostile, AColumnWithoutAKeyIsRefused) {
  Bytes changed = body;
  changed[2 + 22] = 2;
  EXPECT_FALSE(decodes(changed, sample.size()));
}

TEST_F(Hostile, NoByteThatIsChangedDoesHarm) {
  std::mt19937 random{11};
  for (int i = 0; i < 4000; ++i) {
    Bytes changed = body;
    const std::size_t at = random() % std::min<std::size_t>(body.size(), 400);
    changed[at] = static_cast<std::uint8_t>(random());
    const auto back = decode_sample(changed, Codec::kPlanes, sample.size());
    EXPECT_TRUE(!back.ok() || back.value().size() == sample.size());
  }
}

}  // namespace
}  // namespace connect_bridge::media
