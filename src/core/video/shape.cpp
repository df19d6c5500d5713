#include "core/video/shape.hpp"

#include <array>
#include <string_view>

namespace connect_bridge::video {
namespace {

struct Named {
  std::string_view encoding;
  Arrangement arrangement = Arrangement::kGrey;
  std::uint8_t channels = 1;
  bool swapped = false;
};
// Encodings of sensor_msgs/image_encodings.hpp that cameras alone use. Labels, masks and distances
// have others: a wrong value there is worse than a late one.
constexpr std::array kNamed = {
    Named{"rgb8", Arrangement::kColours, 3},
    Named{"bgr8", Arrangement::kColours, 3, true},
    Named{"rgba8", Arrangement::kColours, 4},
    Named{"bgra8", Arrangement::kColours, 4, true},
    Named{"mono8", Arrangement::kGrey},
    Named{"bayer_rggb8", Arrangement::kBayer},
    Named{"bayer_bggr8", Arrangement::kBayer},
    Named{"bayer_gbrg8", Arrangement::kBayer},
    Named{"bayer_grbg8", Arrangement::kBayer},
    Named{"uyvy", Arrangement::kUyvy, 2},
    Named{"yuv422", Arrangement::kUyvy, 2},
    Named{"yuyv", Arrangement::kYuyv, 2},
    Named{"yuv422_yuy2", Arrangement::kYuyv, 2},
    Named{"nv12", Arrangement::kHalfChroma},
    Named{"nv21", Arrangement::kHalfChroma, 1, true},
    Named{"nv24", Arrangement::kFullChroma},
};

bool within(std::uint32_t side) {
  return side >= kSideMin && side <= kSideMax;
}

std::uint32_t half_of(std::uint32_t side) {
  return (side + 1) / 2;
}
Size half_of(Size size) {
  return {half_of(size.width), half_of(size.height)};
}

}  // namespace

std::size_t Shape::rows() const {
  switch (arrangement) {
    case Arrangement::kHalfChroma: return size.height + std::size_t{half_of(size.height)};
    case Arrangement::kFullChroma: return 3 * std::size_t{size.height};
    default: return size.height;
  }
}

Size Shape::coded(bool half) const {
  const bool four = arrangement == Arrangement::kBayer;
  Size plane = four ? half_of(size) : size;
  if (half) plane = half_of(plane);
  return four ? Size{2 * plane.width, 2 * plane.height} : plane;
}

std::optional<Shape> shape_of(const media::ImageLayout& image) {
  if (!within(image.width) || !within(image.height)) return std::nullopt;
  for (std::size_t i = 0; i < kNamed.size(); ++i) {
    const Named& named = kNamed[i];
    if (named.encoding != image.encoding) continue;
    const Shape shape{
        static_cast<std::uint8_t>(i), named.arrangement, named.channels, named.swapped,
        {image.width, image.height},  image.step};
    const bool agrees = shape.used() <= shape.step && shape.data_bytes() == image.data.bytes;
    if (!agrees || image.data.end() > kSampleBytesMax) return std::nullopt;
    return shape;
  }
  return std::nullopt;
}

std::optional<Shape> shape_of_jpeg(Size size, bool is_grey, std::size_t prefix_bytes) {
  // Two bytes for each pixel: noise takes less than one and a half at the quality that is written.
  constexpr std::size_t kPixelBytes = 2;
  if (!within(size.width) || !within(size.height)) return std::nullopt;
  const auto place = static_cast<std::uint8_t>(kNamed.size() + (is_grey ? 1 : 0));
  const std::uint8_t channels = is_grey ? 1 : 3;
  const Shape shape{place, Arrangement::kJpeg, channels, false, size, kPixelBytes * size.width};
  if (prefix_bytes + shape.data_bytes() > kSampleBytesMax) return std::nullopt;
  return shape;
}

}  // namespace connect_bridge::video
