#include "core/media/cloud.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <random>

#include "core/media/layouts.hpp"
#include "core/media/sample_codec.hpp"
#include "unit/media/samples.hpp"

namespace connect_bridge::media {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Compression cloud_with(std::uint32_t step_um, std::uint32_t grid_um = 0) {
  return {Codec::kCloud, 1, false, step_um, grid_um};
}

// Rings of a lidar: x, y, z and an intensity of eight bits.
TestCloud sweep(std::uint32_t rings, std::uint32_t columns) {
  std::mt19937 random{1};
  TestCloud cloud{1, rings * columns, kXyzi, 16, rings * columns * 16, {}};
  cloud.data.resize(cloud.row_step);
  std::vector<double> rings_far(rings);
  for (double& far : rings_far) far = 1 + (random() % 256) / 256.0;
  for (std::uint32_t i = 0; i < cloud.width; ++i) {
    const double turn = 6.283 * (i / rings) / columns;
    const double ring = rings_far[i % rings];
    const double far = ring * (8 + 4 * std::sin(3 * turn)) + 0.01 * (random() % 5);
    set_float(static_cast<float>(far * std::cos(turn)), cloud.data, 16UL * i);
    set_float(static_cast<float>(far * std::sin(turn)), cloud.data, 16UL * i + 4);
    set_float(static_cast<float>(far * (0.005 * (i % rings) - 0.3)), cloud.data, 16UL * i + 8);
    set_float(static_cast<float>(random() % 90), cloud.data, 16UL * i + 12);
  }
  return cloud;
}

Bytes there_and_back(const Bytes& sample, std::uint32_t step_um) {
  const auto body = encode_sample(sample, cloud_with(step_um));
  if (!body) return sample;
  const auto back = decode_sample(*body, Codec::kCloud, sample.size());
  EXPECT_TRUE(back.ok()) << (back.ok() ? "" : back.error().message);
  return back.ok() ? back.value() : Bytes{};
}

std::uint32_t lag_of(const TestCloud& cloud) {
  const auto columns = cloud_columns(cloud_sample(cloud), 1000);
  return columns ? columns->front().lag : 0;
}

TEST(MediaCloud, ExactIsExact) {
  const Bytes sample = cloud_sample(sweep(16, 200));
  const auto body = encode_sample(sample, cloud_with(0));
  ASSERT_TRUE(body);
  EXPECT_EQ(there_and_back(sample, 0), sample);
  EXPECT_EQ(facts_of(*body)->step_um, 0U);
  EXPECT_EQ(facts_of(*body)->raw_bytes, sample.size());
}

TEST(MediaCloud, NoPointMovesByMoreThanHalfAStep) {
  const TestCloud cloud = sweep(16, 200);
  const Bytes sample = cloud_sample(cloud);
  for (const std::uint32_t step_um : {200U, 1000U, 2000U, 5000U, 10000U, 100'000U}) {
    const auto body = encode_sample(sample, cloud_with(step_um));
    ASSERT_TRUE(body);
    EXPECT_EQ(facts_of(*body)->step_um, step_um);
    const Bytes back = there_and_back(sample, step_um);
    ASSERT_EQ(back.size(), sample.size());
    const std::size_t begin = cloud_layout(sample)->data.begin;
    for (std::uint32_t i = 0; i < cloud.width; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t at = begin + 16UL * i + 4 * axis;
        const double error = double{float_at(back, at)} - float_at(sample, at);
        ASSERT_LE(std::abs(error), step_um / 2e6);
      }
      ASSERT_EQ(float_at(back, begin + 16UL * i + 12), float_at(sample, begin + 16UL * i + 12));
    }
    EXPECT_TRUE(std::equal(back.begin(), back.begin() + static_cast<std::ptrdiff_t>(begin),
                           sample.begin()));
    EXPECT_EQ(back.back(), sample.back());
  }
}

TEST(MediaCloud, AStepMakesItSmaller) {
  const Bytes sample = cloud_sample(sweep(16, 500));
  std::size_t before = sample.size();
  for (const std::uint32_t step_um : {0U, 1000U, 10'000U}) {
    const auto body = encode_sample(sample, cloud_with(step_um));
    ASSERT_TRUE(body);
    EXPECT_LT(body->size(), before);
    before = body->size();
  }
}

TEST(MediaCloud, SpecialValuesStayBitForBit) {
  TestCloud cloud = sweep(16, 100);
  const float far = 1e9F;
  std::size_t at = 0;
  for (const float special : {kNan, -kNan, kInfinity, -kInfinity, -0.0F, far, -far, 1e-40F,
                              std::numeric_limits<float>::max()}) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      set_float(special, cloud.data, 16 * ++at + 4 * axis);
    at += 3;
  }
  set_le(std::uint32_t{0x7fc12345}, cloud.data, 16 * 200);  // a NaN that says something
  const Bytes sample = cloud_sample(cloud);
  const Bytes back = there_and_back(sample, 5000);
  ASSERT_EQ(back.size(), sample.size());
  const std::size_t begin = cloud_layout(sample)->data.begin;
  for (std::size_t i = begin; i < begin + cloud.data.size(); i += 4) {
    const float before = float_at(sample, i);
    const float after = float_at(back, i);
    if (!std::isfinite(before) || std::abs(before) > 1e6F || (before == 0 && std::signbit(before)))
      ASSERT_EQ(get_le<std::uint32_t>(back, i), get_le<std::uint32_t>(sample, i));
    else
      ASSERT_LE(std::abs(double{after} - before), 0.0025);
  }
  EXPECT_EQ(there_and_back(sample, 0), sample);
}

// Every value is too far away for a step: all of them come as they are.
TEST(MediaCloud, ACloudBeyondAllStepsIsExact) {
  TestCloud cloud = sweep(4, 100);
  for (std::size_t i = 0; i < cloud.data.size(); i += 4)
    set_float(1e9F + 1e6F * static_cast<float>(i), cloud.data, i);
  const Bytes sample = cloud_sample(cloud);
  EXPECT_EQ(there_and_back(sample, 1000), sample);
}

TEST(MediaCloud, TheLagIsThatOfOneFiring) {
  EXPECT_EQ(lag_of(sweep(16, 300)), 16U);
  EXPECT_EQ(lag_of(sweep(40, 300)), 40U);
  EXPECT_EQ(lag_of(sweep(128, 600)), 128U);
  EXPECT_EQ(lag_of(sweep(1, 3000)), 1U);
}

TEST(MediaCloud, AllFieldsAndThePaddingOfPointsStay) {
  TestCloud cloud{3, 41, {}, 64, 41 * 64, Bytes(3 * 41 * 64)};
  cloud.fields = {{"x", 0},        {"y", 4},        {"z", 8},         {"rgb", 16},
                  {"ring", 20, 4}, {"time", 24, 8}, {"flags", 33, 2}, {"tag", 35, 1, 3},
                  {"n", 40, 6, 2}, {"i", 50, 3}};
  std::mt19937 random{2};
  for (auto& byte : cloud.data) byte = static_cast<std::uint8_t>(random() % 5);
  const Bytes sample = cloud_sample(cloud);
  ASSERT_TRUE(cloud_columns(sample, 0));
  EXPECT_EQ(there_and_back(sample, 0), sample);
  const Bytes back = there_and_back(sample, 1000);
  ASSERT_EQ(back.size(), sample.size());
  const std::size_t begin = cloud_layout(sample)->data.begin;
  for (std::size_t i = 0; i < sample.size(); ++i) {
    const bool coordinate = i >= begin && (i - begin) % 64 < 12;
    ASSERT_TRUE(coordinate || back[i] == sample[i]) << i;
  }
}

// Rows' padding looks like points, and must not be rounded.
TEST(MediaCloud, PaddingOfRowsIsKeptAndMakesTheCloudExact) {
  TestCloud cloud = sweep(16, 100);
  cloud.height = 10;
  cloud.width = 159;
  cloud.row_step = 160 * 16;
  const Bytes sample = cloud_sample(cloud);
  EXPECT_EQ(there_and_back(sample, 5000), sample);
}

TEST(MediaCloud, WhatDisagreesWithItselfIsOpaque) {
  const TestCloud good = sweep(4, 30);
  ASSERT_TRUE(cloud_columns(cloud_sample(good), 0));
  const auto refused = [&](auto change) {
    TestCloud cloud = good;
    change(cloud);
    const Bytes sample = cloud_sample(cloud);
    EXPECT_FALSE(cloud_columns(sample, 1000));
    EXPECT_EQ(there_and_back(sample, 1000), sample);
  };
  refused([](TestCloud& c) { c.point_step = 0; });
  refused([](TestCloud& c) { c.point_step = 7; });
  refused([](TestCloud& c) { c.fields.back().offset = 13; });
  refused([](TestCloud& c) { c.fields.back().offset = 0xfffffffe; });
  refused([](TestCloud& c) { c.fields.back().count = 0x80000000; });
  refused([](TestCloud& c) { c.fields.back().datatype = 9; });
  refused([](TestCloud& c) { c.fields.back().offset = 10; });  // two fields share bytes
  refused([](TestCloud& c) { c.big_endian = true; });
  refused([](TestCloud& c) { c.data.pop_back(); });
  refused([](TestCloud& c) { c.data.clear(); });
  const Bytes sample = cloud_sample(good);
  for (std::size_t size = 0; size < sample.size(); ++size)
    EXPECT_FALSE(cloud_columns(ByteView(sample).first(size), 1000)) << size;
}

TEST(MediaCloud, APartOfACloudHasNoLayout) {
  const Bytes sample = cloud_sample(sweep(2, 2));
  ASSERT_TRUE(cloud_layout(sample));
  for (std::size_t size = 0; size + 4 < sample.size(); ++size)
    EXPECT_FALSE(cloud_layout(ByteView(sample).first(size))) << size;
}

TEST(MediaCloud, EncodingStopsWhenItIsNotNeeded) {
  const Bytes sample = cloud_sample(sweep(16, 200));
  std::atomic<bool> give_up = false;
  EXPECT_TRUE(encode_sample(sample, cloud_with(0), &give_up));
  give_up = true;
  EXPECT_FALSE(encode_sample(sample, cloud_with(0), &give_up));
}

TEST(MediaCloud, ACloudWithoutFieldsIsPadding) {
  TestCloud cloud = sweep(4, 100);
  cloud.fields.clear();
  const Bytes sample = cloud_sample(cloud);
  ASSERT_TRUE(cloud_columns(sample, 1000));
  EXPECT_EQ(there_and_back(sample, 1000), sample);
}

TEST(MediaCloud, TheGridKeepsTheFirstPointOfEachCell) {
  TestCloud cloud{2, 4, kXyzi, 16, 64, Bytes(128)};
  const float points[8][3] = {{0.01F, 0.01F, 0.01F}, {0.09F, 0, 0}, {0.11F, 0, 0}, {kNan, 0, 0},
                              {-0.01F, 0, 0},        {0.12F, 0, 0}, {1e9F, 0, 0},  {1e9F, 0, 0}};
  for (std::size_t i = 0; i < 8; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      set_float(points[i][axis], cloud.data, 16 * i + 4 * axis);
    set_float(static_cast<float>(i), cloud.data, 16 * i + 12);
  }
  const auto thin = thinned(cloud_sample(cloud), 100'000);
  ASSERT_TRUE(thin);
  const auto layout = cloud_layout(*thin);
  ASSERT_TRUE(layout);
  EXPECT_EQ(layout->height, 1U);
  EXPECT_EQ(layout->width, 5U);
  EXPECT_TRUE(layout->is_tight());
  EXPECT_EQ(thin->back(), 1);
  std::vector<float> kept;
  for (std::size_t i = 0; i < 5; ++i)
    kept.push_back(float_at(*thin, layout->data.begin + 16 * i + 12));
  EXPECT_EQ(kept, (std::vector<float>{0, 2, 4, 6, 7}));  // too far for a cell: all stay
}

TEST(MediaCloud, AThinnedBodySaysItsSize) {
  const Bytes sample = cloud_sample(sweep(16, 300));
  const auto body = encode_sample(sample, cloud_with(0, 2'000'000));
  ASSERT_TRUE(body);
  const auto facts = facts_of(*body);
  ASSERT_TRUE(facts);
  EXPECT_LT(facts->raw_bytes, sample.size() / 4);
  const auto back = decode_sample(*body, Codec::kCloud, facts->raw_bytes);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back.value(), *thinned(sample, 2'000'000));
}

TEST(MediaCloud, HostileBodiesDoNoHarm) {
  const Bytes sample = cloud_sample(sweep(16, 60));
  const Bytes body = encode_sample(sample, cloud_with(1000)).value_or(Bytes{});
  ASSERT_TRUE(decode_sample(body, Codec::kCloud, sample.size()).ok());
  EXPECT_FALSE(decode_sample(body, Codec::kPlanes, sample.size()).ok());  // planes are exact
  EXPECT_FALSE(decode_sample(body, Codec::kZstd, sample.size()).ok());
  std::mt19937 random{11};
  for (int i = 0; i < 4000; ++i) {
    Bytes changed = body;
    changed[random() % std::min<std::size_t>(body.size(), 300)] =
        static_cast<std::uint8_t>(random());
    const auto back = decode_sample(changed, Codec::kCloud, sample.size());
    EXPECT_TRUE(!back.ok() || back.value().size() == sample.size());
  }
}

}  // namespace
}  // namespace connect_bridge::media
