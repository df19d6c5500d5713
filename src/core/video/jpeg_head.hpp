// The size of a JPEG by its head. Cheap enough for the loop: nothing is decoded.
#pragma once

#include <optional>

#include "core/base/bytes.hpp"
#include "core/video/shape.hpp"

namespace connect_bridge::video {

struct JpegHead {
  Size size;
  bool is_grey = false;
};
// nullopt: no JPEG, or one of a kind that cameras do not make (lossless, arithmetic, CMYK, 12
// bits).
[[nodiscard]] std::optional<JpegHead> jpeg_head(ByteView jpeg);

}  // namespace connect_bridge::video
