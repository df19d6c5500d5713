// The three planes of a VP8 frame (4:2:0), and the ways between them and the data of an Image.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/bytes.hpp"
#include "core/video/shape.hpp"

namespace connect_bridge::video {

// Planes that lie elsewhere; those of u and v have half the width and the height, rounded up.
struct YuvView {
  Size size;
  const std::uint8_t* y = nullptr;
  const std::uint8_t* u = nullptr;
  const std::uint8_t* v = nullptr;
  std::size_t y_step = 0;
  std::size_t uv_step = 0;
};

// Planes of its own, without padding.
class Yuv {
 public:
  // The planes hold anything after a change of size.
  void resize(Size size);
  [[nodiscard]] Size size() const { return size_; }
  [[nodiscard]] Size chroma() const { return {(size_.width + 1) / 2, (size_.height + 1) / 2}; }
  [[nodiscard]] std::uint8_t* y() { return bytes_.data(); }
  [[nodiscard]] std::uint8_t* u() { return y() + std::size_t{size_.width} * size_.height; }
  [[nodiscard]] std::uint8_t* v() { return u() + std::size_t{chroma().width} * chroma().height; }
  [[nodiscard]] YuvView view();

 private:
  Size size_;
  Bytes bytes_;
};

// The data of an Image, all of them, to planes of its coded size, and back. Padding is not written.
void to_yuv(const std::uint8_t* data, const Shape& shape, Yuv& to);
void from_yuv(const YuvView& from, const Shape& shape, std::uint8_t* data);

// To half the width and height, and back.
void halve(const YuvView& from, const Shape& shape, Yuv& to);
void enlarge(const YuvView& from, const Shape& shape, Yuv& to);

// Each pixel's alpha is 255.
[[nodiscard]] bool is_opaque(const std::uint8_t* data, const Shape& shape);

}  // namespace connect_bridge::video
