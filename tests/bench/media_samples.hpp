// Pictures, distances and a sweep of the sizes and the noise that cameras and lidars have, drawn:
// no recording is needed, and each run has the same bytes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "core/base/byte_order.hpp"
#include "unit/media/samples.hpp"

namespace bench {

using namespace connect_bridge;

inline constexpr std::uint32_t kWidth = 640;
inline constexpr std::uint32_t kHeight = 480;

// Surfaces with texture and edges, a gradient of light, and noise of each channel.
inline Bytes drawn_picture() {
  std::mt19937 random{1};
  std::normal_distribution<double> noise{0, 2};
  media::TestImage image{kHeight, kWidth, "rgb8", 3 * kWidth, false, Bytes(3UL * kWidth * kHeight)};
  for (std::size_t i = 0; i < std::size_t{kWidth} * kHeight; ++i) {
    const double x = static_cast<double>(i % kWidth);
    const double y = static_cast<double>(i / kWidth);
    const bool wall = std::fmod(x + y / 3, 160) < 90;
    const double grey = 90 + 40 * std::sin(x / 37) * std::cos(y / 23) + (wall ? 50 : 0) +
                        12 * std::sin(x * 0.9) * std::sin(y * 1.1);
    const double tint[3] = {wall ? 10.0 : -20.0, 0, wall ? -25.0 : 15.0};
    for (std::size_t c = 0; c < 3; ++c)
      image.data[3 * i + c] =
          static_cast<std::uint8_t>(std::clamp(grey + tint[c] + noise(random), 0.0, 255.0));
  }
  return media::image_sample(image);
}

// A stereo camera's distances in millimetres: noise of 1.2 mm at a metre, growing with the square.
inline Bytes drawn_depth() {
  std::mt19937 random{2};
  std::normal_distribution<double> noise{0, 1};
  media::TestImage image{kHeight,    kWidth, "16UC1",
                         2 * kWidth, false,  Bytes(2UL * kWidth * kHeight)};
  for (std::size_t i = 0; i < std::size_t{kWidth} * kHeight; ++i) {
    const double x = static_cast<double>(i % kWidth);
    const double y = static_cast<double>(i / kWidth);
    const double far = (std::fmod(x, 200) < 80 ? 1.4 : 3.2) + y / 400;
    const bool hole = std::fmod(x * 3 + y, 211) < 6;
    const double mm = hole ? 0 : 1000 * far + 1.2 * far * far * noise(random);
    set_le(static_cast<std::uint16_t>(mm), image.data, 2 * i);
  }
  return media::image_sample(image);
}

// 64 rings of 1,803 points, ring by ring: the ground, walls of a street, 1.5 cm of noise, an
// intensity of eight bits; one point in 40 is missing.
inline Bytes drawn_sweep() {
  constexpr std::uint32_t kRings = 64, kColumns = 1803;
  std::mt19937 random{3};
  std::normal_distribution<double> noise{0, 0.015};
  media::TestCloud cloud{1, 0, media::kXyzi, 16, 0, {}};
  for (std::uint32_t i = 0; i < kRings * kColumns; ++i) {
    if (random() % 40 == 0) continue;
    const double up = 0.035 - 0.0073 * (i / kColumns);
    const double turn = 6.2832 * (i % kColumns) / kColumns;
    const double wall = std::min(9 / std::max(std::abs(std::sin(turn)), 0.1), 70.0) +
                        (std::fmod(turn, 0.5) < 0.12 ? -2.0 : 0.0);
    const double ground = up < 0 ? 1.7 / -up : 100;
    const double far = std::min(wall, ground) + noise(random);
    Bytes point(16);
    media::set_float(static_cast<float>(far * std::cos(turn)), point, 0);
    media::set_float(static_cast<float>(far * std::sin(turn)), point, 4);
    media::set_float(static_cast<float>(far * up), point, 8);
    const double shine = far < ground ? 60 + 30 * std::sin(turn * 9) : 25;
    media::set_float(static_cast<float>(static_cast<int>(shine + random() % 12)) / 100, point, 12);
    cloud.data.insert(cloud.data.end(), point.begin(), point.end());
    ++cloud.width;
  }
  cloud.row_step = 16 * cloud.width;
  return media::cloud_sample(cloud);
}

}  // namespace bench
