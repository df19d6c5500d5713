// How alike two samples of an Image look.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/media/layouts.hpp"

namespace connect_bridge::video {

struct Grey {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<double> values;
};

// Luma of what a sample shows; of a bayer pattern its values as they are.
inline Grey luma_of(ByteView sample) {
  const auto image = media::image_layout(sample).value();
  const std::string_view form = image.encoding;
  const ByteView data = sample.subspan(image.data.begin);
  const bool colours = form.starts_with("rgb") || form.starts_with("bgr");
  const bool packed = form.starts_with("yuyv") || form == "yuv422_yuy2";
  const bool swapped_packed = form == "uyvy" || form == "yuv422";
  const std::size_t pixel = colours ? (form[3] == 'a' ? 4 : 3) : (packed || swapped_packed ? 2 : 1);
  Grey grey{image.width, image.height, {}};
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x) {
      const std::uint8_t* const at = data.data() + y * image.step + x * pixel;
      const bool red_first = form.front() == 'r';
      grey.values.push_back(colours ? 0.299 * at[red_first ? 0 : 2] + 0.587 * at[1] +
                                          0.114 * at[red_first ? 2 : 0]
                                    : at[swapped_packed ? 1 : 0]);
    }
  return grey;
}

// Structural similarity in blocks of 8 x 8, one every 4 values.
inline double ssim(const Grey& a, const Grey& b) {
  double sum = 0;
  int blocks = 0;
  for (std::uint32_t top = 0; top + 8 <= a.height; top += 4)
    for (std::uint32_t left = 0; left + 8 <= a.width; left += 4) {
      double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
      for (std::uint32_t y = top; y < top + 8; ++y)
        for (std::uint32_t x = left; x < left + 8; ++x) {
          const double va = a.values[y * a.width + x], vb = b.values[y * b.width + x];
          sa += va, sb += vb, saa += va * va, sbb += vb * vb, sab += va * vb;
        }
      const double ma = sa / 64, mb = sb / 64;
      const double c1 = 6.5025, c2 = 58.5225;
      sum += (2 * ma * mb + c1) * (2 * (sab / 64 - ma * mb) + c2) /
             ((ma * ma + mb * mb + c1) * (saa / 64 - ma * ma + sbb / 64 - mb * mb + c2));
      ++blocks;
    }
  return sum / blocks;
}

}  // namespace connect_bridge::video
