// Drawn pictures of a camera that moves: surfaces with texture and edges, a gradient of light. The
// number of a picture and its form give all its bytes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "unit/media/samples.hpp"

namespace connect_bridge::video {

struct Scene {
  std::uint32_t width = 320;
  std::uint32_t height = 240;
  std::string_view encoding = "rgb8";
  std::uint32_t padding = 0;  // of each row
  double speed = 3;           // pixels for each picture
  int place = 0;              // each has other surfaces
  double detail = 1;          // texture; 0: smooth
};

struct Colour {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
};

inline std::uint8_t shade(double value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0) + 0.5);
}

inline Colour colour_at(const Scene& scene, std::uint32_t number, std::uint32_t column,
                        std::uint32_t row) {
  const double x = column + scene.speed * number + 977.0 * scene.place;
  const double y = row + scene.speed * 0.3 * number;
  const bool wall = scene.detail > 0 && std::fmod(x + y / 3, 160) < 90;
  const double texture = scene.detail * 12 * std::sin(x * 0.9) * std::sin(y * 1.1);
  const double grey =
      90 + 40 * std::sin(x / (37 - scene.place % 7)) * std::cos(y / 23) + (wall ? 50 : 0) + texture;
  const double tint = 25 * std::sin(x / 61) * std::sin(y / 47);
  return {shade(grey + tint), shade(grey), shade(grey - tint)};
}

inline Colour swapped(const Colour& colour) {
  return {colour.blue, colour.green, colour.red};
}

// Y, U, V of full-range BT.601.
inline Colour yuv_of(const Colour& c) {
  return {shade(0.299 * c.red + 0.587 * c.green + 0.114 * c.blue),
          shade(128 - 0.168736 * c.red - 0.331264 * c.green + 0.5 * c.blue),
          shade(128 + 0.5 * c.red - 0.418688 * c.green - 0.081312 * c.blue)};
}

// The bytes of padding are 7: a picture loses them.
class SceneWriter {
 public:
  SceneWriter(const Scene& scene, std::uint32_t number) : scene_(scene), number_(number) {}

  Bytes sample() {
    const std::string_view form = scene_.encoding;
    const std::size_t at = form.find("8");
    const bool has_alpha = form == "rgba8" || form == "bgra8";
    if (form == "rgb8" || form == "bgr8" || has_alpha) {
      rows(scene_.height, has_alpha ? 4 : 3);
      colours(form.front() == 'b', has_alpha);
    } else if (form == "mono8") {
      rows(scene_.height, 1);
      luma(0, 1);
    } else if (form.starts_with("bayer_")) {
      rows(scene_.height, 1);
      bayer(form.substr(6, at - 6));
    } else if (form.starts_with("uyvy") || form == "yuv422") {
      rows(scene_.height, 2);
      luma(1, 2);
      packed(0);
    } else if (form.starts_with("yuyv") || form == "yuv422_yuy2") {
      rows(scene_.height, 2);
      luma(0, 2);
      packed(1);
    } else {
      const bool full = form == "nv24";
      rows(full ? 3 * scene_.height : scene_.height + (scene_.height + 1) / 2, 1);
      luma(0, 1);
      full ? full_chroma() : half_chroma(form == "nv21");
    }
    return media::image_sample(image_);
  }

 private:
  void rows(std::uint32_t count, std::uint32_t pixel) {
    image_ = {scene_.height,   scene_.width,
              scene_.encoding, scene_.width * pixel + scene_.padding,
              false,           {}};
    image_.data.assign(std::size_t{count} * image_.step, 7);
  }
  [[nodiscard]] Colour colour(std::uint32_t x, std::uint32_t y) const {
    return colour_at(scene_, number_, std::min(x, scene_.width - 1),
                     std::min(y, scene_.height - 1));
  }
  std::uint8_t& at(std::size_t row, std::size_t byte) {
    return image_.data[row * image_.step + byte];
  }
  template <class Put>
  void each(Put put) {
    for (std::uint32_t y = 0; y < scene_.height; ++y)
      for (std::uint32_t x = 0; x < scene_.width; ++x) put(x, y);
  }
  void colours(bool blue_first, bool has_alpha) {
    const std::uint32_t pixel = has_alpha ? 4 : 3;
    each([&](std::uint32_t x, std::uint32_t y) {
      const Colour c = blue_first ? swapped(colour(x, y)) : colour(x, y);
      at(y, pixel * x) = c.red;
      at(y, pixel * x + 1) = c.green;
      at(y, pixel * x + 2) = c.blue;
      if (has_alpha) at(y, pixel * x + 3) = 255;
    });
  }
  void luma(std::uint32_t begin, std::uint32_t distance) {
    each([&](std::uint32_t x, std::uint32_t y) {
      at(y, begin + distance * x) = yuv_of(colour(x, y)).red;
    });
  }
  void bayer(std::string_view order) {
    each([&](std::uint32_t x, std::uint32_t y) {
      const Colour c = colour(x, y);
      const char name = order[y % 2 * 2 + x % 2];
      at(y, x) = name == 'r' ? c.red : name == 'g' ? c.green : c.blue;
    });
  }
  void packed(std::uint32_t begin) {
    each([&](std::uint32_t x, std::uint32_t y) {
      const Colour c = yuv_of(colour(x - x % 2, y));
      at(y, begin + 2 * x) = x % 2 == 0 ? c.green : c.blue;
    });
  }
  void half_chroma(bool swap) {
    for (std::uint32_t y = 0; y < (scene_.height + 1) / 2; ++y)
      for (std::uint32_t x = 0; x < scene_.width; ++x) {
        const Colour c = yuv_of(colour(x - x % 2, 2 * y));
        at(scene_.height + y, x) = (x % 2 == 0) != swap ? c.green : c.blue;
      }
  }
  void full_chroma() {
    for (std::uint32_t y = 0; y < scene_.height; ++y)
      for (std::uint32_t i = 0; i < 2 * scene_.width; ++i) {
        const Colour c = yuv_of(colour(i / 2, y));
        at(scene_.height + 2 * y + i / scene_.width, i % scene_.width) =
            i % 2 == 0 ? c.green : c.blue;
      }
  }

  const Scene& scene_;
  std::uint32_t number_;
  media::TestImage image_;
};

inline Bytes picture_of(const Scene& scene, std::uint32_t number) {
  return SceneWriter(scene, number).sample();
}

}  // namespace connect_bridge::video
