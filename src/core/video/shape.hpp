// The encodings of Images that may become pictures, and where their values lie.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/media/layouts.hpp"

namespace connect_bridge::video {

enum class Arrangement : std::uint8_t {
  kColours,     // red, green and blue of a pixel side by side, perhaps with alpha
  kGrey,        // one byte for each pixel
  kBayer,       // squares of four
  kYuyv,        // 4:2:2
  kUyvy,        // 4:2:2
  kHalfChroma,  // rows of luma, then half as many rows of u and v side by side
  kFullChroma,  // rows of luma, then twice as many bytes of u and v
  kJpeg,        // a JPEG has them; `step` and the bytes of data are the most it may take
};

struct Size {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  bool operator==(const Size&) const = default;
};

struct Shape {
  std::uint8_t encoding = 0;  // place in the list of encodings
  Arrangement arrangement = Arrangement::kGrey;
  std::uint8_t channels = 1;
  bool swapped = false;  // blue before red, or v before u
  Size size;
  std::size_t step = 0;

  // Bytes of a row that hold values; the others are padding.
  [[nodiscard]] std::size_t used() const { return std::size_t{size.width} * channels; }
  [[nodiscard]] std::size_t rows() const;
  // Of a JPEG: at most, its head included.
  [[nodiscard]] std::size_t data_bytes() const {
    return rows() * step + (is_jpeg() ? kJpegHeadBytes : 0);
  }
  static constexpr std::size_t kJpegHeadBytes = 1024;
  [[nodiscard]] bool has_alpha() const { return channels == 4; }
  [[nodiscard]] bool is_jpeg() const { return arrangement == Arrangement::kJpeg; }
  [[nodiscard]] bool is_grey_jpeg() const { return is_jpeg() && channels == 1; }
  // The size of the VP8 frame.
  [[nodiscard]] Size coded(bool half) const;
};
// nullopt: no encoding of pictures, out of bounds, or the data disagree with the size.
[[nodiscard]] std::optional<Shape> shape_of(const media::ImageLayout& image);

// The same of a JPEG behind `prefix_bytes` of its sample; a grey one has luma alone.
[[nodiscard]] std::optional<Shape> shape_of_jpeg(Size size, bool is_grey, std::size_t prefix_bytes);

// Out of these bounds, samples are no pictures.
inline constexpr std::uint32_t kSideMin = 32;
inline constexpr std::uint32_t kSideMax = 4096;
inline constexpr std::size_t kSampleBytesMax = std::size_t{16} << 20;

}  // namespace connect_bridge::video
