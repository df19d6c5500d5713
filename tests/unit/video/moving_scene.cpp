#include "unit/video/moving_scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "unit/media/samples.hpp"

namespace connect_bridge::video {
namespace {

struct Colour {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
};

std::uint8_t shade(double value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0) + 0.5);
}

std::uint32_t mixed(std::uint32_t value) {
  value = (value ^ value >> 15) * 0x2c1b3c6dU;
  value = (value ^ value >> 12) * 0x297a2d39U;
  return value ^ value >> 15;
}

// Between -1 and 1, drawn at whole numbers and mixed between them.
double lattice(double x, double y, std::uint32_t seed) {
  const double left = std::floor(x), top = std::floor(y);
  const auto drawn = [&](int right, int down) {
    const auto column = static_cast<std::uint32_t>(static_cast<int>(left) + right);
    const auto row = static_cast<std::uint32_t>(static_cast<int>(top) + down);
    return mixed(column * 8191 + row * 131071 + seed * 524287) / 2147483648.0 - 1;
  };
  const double a = x - left, b = y - top;
  return (drawn(0, 0) * (1 - a) + drawn(1, 0) * a) * (1 - b) +
         (drawn(0, 1) * (1 - a) + drawn(1, 1) * a) * b;
}

Colour colour_at(const Scene& scene, std::uint32_t number, std::uint32_t column,
                 std::uint32_t row) {
  const double x = column + scene.speed * number;
  const double y = row + scene.speed * 0.3 * number;
  const auto seed = static_cast<std::uint32_t>(scene.place);
  double grey = 120 + 50 * std::sin(x / (57 + scene.place)) * std::cos(y / 43);
  // Large surfaces have much contrast, small ones little, as in photos.
  if (scene.detail > 0)
    for (const double size : {48.0, 20.0, 8.0, 3.5, 1.5})
      grey += scene.detail * (8 + size / 2) * lattice(x / size, y / size, seed);
  const double tint = 25 * std::sin(x / 61) * std::sin(y / 47);
  if (scene.noise <= 0) return {shade(grey + tint), shade(grey), shade(grey - tint)};
  std::uint32_t seen = mixed((number * 4099 + row) * 8191 + column);
  const auto noise = [&] {
    seen = mixed(seen + 1);
    return scene.noise * (seen / 2147483648.0 - 1);
  };
  return {shade(grey + tint + noise()), shade(grey + noise()), shade(grey - tint + noise())};
}

Colour swapped(const Colour& colour) {
  return {colour.blue, colour.green, colour.red};
}

// Y, U, V of full-range BT.601.
Colour yuv_of(const Colour& c) {
  return {shade(0.299 * c.red + 0.587 * c.green + 0.114 * c.blue),
          shade(128 - 0.168736 * c.red - 0.331264 * c.green + 0.5 * c.blue),
          shade(128 + 0.5 * c.red - 0.418688 * c.green - 0.081312 * c.blue)};
}

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

}  // namespace

Bytes picture_of(const Scene& scene, std::uint32_t number) {
  return SceneWriter(scene, number).sample();
}

}  // namespace connect_bridge::video
