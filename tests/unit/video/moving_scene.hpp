// Drawn pictures of a camera that moves: surfaces with texture and edges, a gradient of light. The
// number of a picture and its form give all its bytes.
#pragma once

#include <cstdint>
#include <string_view>

#include "core/base/bytes.hpp"

namespace connect_bridge::video {

struct Scene {
  std::uint32_t width = 320;
  std::uint32_t height = 240;
  std::string_view encoding = "rgb8";
  std::uint32_t padding = 0;  // of each row
  double speed = 3;           // pixels for each picture
  int place = 0;              // each has other surfaces
  double detail = 1;          // texture; 0: smooth
  double noise = 0;           // of the sensor, at most
};

// A sample of an Image. The bytes of padding are 7: a picture loses them.
[[nodiscard]] Bytes picture_of(const Scene& scene, std::uint32_t number);

}  // namespace connect_bridge::video
