#include "core/video/yuv.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

namespace connect_bridge::video {
namespace {

constexpr std::uint8_t kNoColour = 128;

// Full-range BT.601 in 1/256: all values of a camera's red, green and blue have a place in it.
template <int kChannels, int kRed>
void luma_row(const std::uint8_t* in, std::uint32_t width, std::uint8_t* out) {
  for (std::uint32_t x = 0; x < width; ++x) {
    const std::uint8_t* const pixel = in + std::size_t{kChannels} * x;
    out[x] = static_cast<std::uint8_t>(
        (77 * pixel[kRed] + 150 * pixel[1] + 29 * pixel[2 - kRed] + 128) >> 8);
  }
}

struct Chroma {
  std::uint8_t* u = nullptr;
  std::uint8_t* v = nullptr;
};

// The mean of four pixels, each colour of which comes as a sum.
void put_chroma(int red, int green, int blue, std::uint8_t& u, std::uint8_t& v) {
  constexpr int kMiddle = (kNoColour << 10) + 511;
  u = static_cast<std::uint8_t>((-43 * red - 85 * green + 128 * blue + kMiddle) >> 10);
  v = static_cast<std::uint8_t>((128 * red - 107 * green - 21 * blue + kMiddle) >> 10);
}

template <int kChannels, int kRed>
void chroma_row(const std::uint8_t* upper, const std::uint8_t* lower, std::uint32_t width,
                Chroma out) {
  const auto sum = [&](std::size_t at, std::size_t next) {
    return upper[at] + upper[at + next] + lower[at] + lower[at + next];
  };
  for (std::uint32_t x = 0; x < width / 2; ++x) {
    const std::size_t at = std::size_t{2} * kChannels * x;
    put_chroma(sum(at + kRed, kChannels), sum(at + 1, kChannels), sum(at + 2 - kRed, kChannels),
               out.u[x], out.v[x]);
  }
  if (width % 2 == 0) return;
  const std::size_t at = std::size_t{kChannels} * (width - 1);
  put_chroma(sum(at + kRed, 0), sum(at + 1, 0), sum(at + 2 - kRed, 0), out.u[width / 2],
             out.v[width / 2]);
}

template <int kChannels, int kRed>
void colours_to_yuv(const std::uint8_t* data, const Shape& shape, Yuv& to) {
  const auto [width, height] = shape.size;
  const std::size_t chroma_width = to.chroma().width;
  for (std::uint32_t y = 0; y < height; y += 2) {
    const std::uint8_t* const upper = data + y * shape.step;
    const std::uint8_t* const lower = y + 1 < height ? upper + shape.step : upper;
    std::uint8_t* const luma = to.y() + std::size_t{y} * width;
    luma_row<kChannels, kRed>(upper, width, luma);
    if (lower != upper) luma_row<kChannels, kRed>(lower, width, luma + width);
    chroma_row<kChannels, kRed>(upper, lower, width,
                                {to.u() + y / 2 * chroma_width, to.v() + y / 2 * chroma_width});
  }
}

std::uint8_t within_byte(int value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0, 255));
}

// A pixel's chroma as it adds to the luma, in 1/256 with a half for rounding.
struct Tint {
  Tint(std::uint8_t u, std::uint8_t v)
      : red(359 * (v - 128) + 128),
        green(-88 * (u - 128) - 183 * (v - 128) + 128),
        blue(454 * (u - 128) + 128) {}
  int red;
  int green;
  int blue;
};

template <int kChannels, int kRed>
void put_pixel(std::uint8_t luma, const Tint& tint, std::uint8_t* pixel) {
  const int scaled = luma << 8;
  pixel[kRed] = within_byte((scaled + tint.red) >> 8);
  pixel[1] = within_byte((scaled + tint.green) >> 8);
  pixel[2 - kRed] = within_byte((scaled + tint.blue) >> 8);
  if constexpr (kChannels == 4) pixel[3] = 255;
}

template <int kChannels, int kRed>
void colours_from_yuv(const YuvView& from, const Shape& shape, std::uint8_t* data) {
  const auto [width, height] = shape.size;
  for (std::uint32_t y = 0; y < height; ++y) {
    const std::uint8_t* const luma = from.y + y * from.y_step;
    const std::uint8_t* const u = from.u + y / 2 * from.uv_step;
    const std::uint8_t* const v = from.v + y / 2 * from.uv_step;
    std::uint8_t* const out = data + y * shape.step;
    for (std::uint32_t x = 0; x < width / 2; ++x) {
      const Tint tint(u[x], v[x]);
      std::uint8_t* const pixel = out + std::size_t{2} * kChannels * x;
      put_pixel<kChannels, kRed>(luma[2 * x], tint, pixel);
      put_pixel<kChannels, kRed>(luma[2 * x + 1], tint, pixel + kChannels);
    }
    if (width % 2 != 0)
      put_pixel<kChannels, kRed>(luma[width - 1], {u[width / 2], v[width / 2]},
                                 out + std::size_t{kChannels} * (width - 1));
  }
}

void copy_rows(const std::uint8_t* from, std::size_t from_step, Size size, std::uint8_t* to,
               std::size_t to_step) {
  for (std::uint32_t y = 0; y < size.height; ++y)
    std::memcpy(to + y * to_step, from + y * from_step, size.width);
}

void fill_chroma(Yuv& to) {
  const Size chroma = to.chroma();
  std::memset(to.u(), kNoColour, std::size_t{2} * chroma.width * chroma.height);
}

// ---- bayer: the upper left values of all squares are one plane; the next to it on its right, the
// lower ones below. An odd side's missing values repeat those before.

void bayer_to_yuv(const std::uint8_t* data, const Shape& shape, Yuv& to) {
  const auto [width, height] = shape.size;
  const Size all = to.size();
  const Size plane{all.width / 2, all.height / 2};
  for (std::uint32_t y = 0; y < all.height; ++y) {
    const std::uint8_t* const in = data + (y < height ? y : y - 2) * shape.step;
    std::uint8_t* const left = to.y() + std::size_t{y % 2 * plane.height + y / 2} * all.width;
    std::uint8_t* const right = left + plane.width;
    for (std::uint32_t x = 0; x < width / 2; ++x) {
      left[x] = in[2 * x];
      right[x] = in[2 * x + 1];
    }
    if (width % 2 == 0) continue;
    left[width / 2] = in[width - 1];
    right[width / 2] = in[width - 2];
  }
  fill_chroma(to);
}

void bayer_from_yuv(const YuvView& from, const Shape& shape, std::uint8_t* data) {
  const auto [width, height] = shape.size;
  const Size plane{from.size.width / 2, from.size.height / 2};
  for (std::uint32_t y = 0; y < height; ++y) {
    const std::uint8_t* const left = from.y + (y % 2 * plane.height + y / 2) * from.y_step;
    std::uint8_t* const out = data + y * shape.step;
    for (std::uint32_t x = 0; x < width / 2; ++x) {
      out[2 * x] = left[x];
      out[2 * x + 1] = left[plane.width + x];
    }
    if (width % 2 != 0) out[width - 1] = left[width / 2];
  }
}

// ---- chroma side by side: pairs of two bytes, of which the last may lack its second

// Each `distance` bytes one value, `offset` bytes further the other one.
struct Pairs {
  std::size_t distance = 2;
  std::size_t offset = 1;
};

Chroma chroma_of(Yuv& to, bool swapped, std::uint32_t row) {
  const std::size_t at = std::size_t{row} * to.chroma().width;
  return swapped ? Chroma{to.v() + at, to.u() + at} : Chroma{to.u() + at, to.v() + at};
}

std::uint8_t mean(int a, int b) {
  return static_cast<std::uint8_t>((a + b + 1) / 2);
}

// The mean of two rows; the second half of a pair that is not there repeats the one before.
void split_pairs(const std::uint8_t* upper, const std::uint8_t* lower, Pairs pairs,
                 std::uint32_t width, Chroma out) {
  for (std::uint32_t x = 0; x < width / 2; ++x) {
    const std::size_t at = pairs.distance * x;
    out.u[x] = mean(upper[at], lower[at]);
    out.v[x] = mean(upper[at + pairs.offset], lower[at + pairs.offset]);
  }
  if (width % 2 == 0) return;
  const std::size_t at = pairs.distance * (width / 2);
  out.u[width / 2] = mean(upper[at], lower[at]);
  out.v[width / 2] = out.v[width / 2 - 1];
}

struct ChromaRow {
  const std::uint8_t* u = nullptr;
  const std::uint8_t* v = nullptr;
};
ChromaRow chroma_of(const YuvView& from, bool swapped, std::uint32_t row) {
  const std::size_t at = row * from.uv_step;
  return swapped ? ChromaRow{from.v + at, from.u + at} : ChromaRow{from.u + at, from.v + at};
}

void join_pairs(ChromaRow from, Pairs pairs, std::uint32_t width, std::uint8_t* out) {
  for (std::uint32_t x = 0; x < width / 2; ++x) {
    out[pairs.distance * x] = from.u[x];
    out[pairs.distance * x + pairs.offset] = from.v[x];
  }
  if (width % 2 != 0) out[pairs.distance * (width / 2)] = from.u[width / 2];
}

constexpr Pairs kPacked{4, 2};

void packed_to_yuv(const std::uint8_t* data, const Shape& shape, std::size_t luma_at, Yuv& to) {
  const auto [width, height] = shape.size;
  for (std::uint32_t y = 0; y < height; ++y) {
    const std::uint8_t* const in = data + y * shape.step + luma_at;
    std::uint8_t* const out = to.y() + std::size_t{y} * width;
    for (std::uint32_t x = 0; x < width; ++x) out[x] = in[std::size_t{2} * x];
  }
  for (std::uint32_t y = 0; y < height; y += 2) {
    const std::uint8_t* const upper = data + y * shape.step + (1 - luma_at);
    const std::uint8_t* const lower = y + 1 < height ? upper + shape.step : upper;
    split_pairs(upper, lower, kPacked, width, chroma_of(to, shape.swapped, y / 2));
  }
}

void packed_from_yuv(const YuvView& from, const Shape& shape, std::size_t luma_at,
                     std::uint8_t* data) {
  const auto [width, height] = shape.size;
  for (std::uint32_t y = 0; y < height; ++y) {
    const std::uint8_t* const in = from.y + y * from.y_step;
    std::uint8_t* const out = data + y * shape.step;
    for (std::uint32_t x = 0; x < width; ++x) out[std::size_t{2} * x + luma_at] = in[x];
    join_pairs(chroma_of(from, shape.swapped, y / 2), kPacked, width, out + (1 - luma_at));
  }
}

void half_chroma_to_yuv(const std::uint8_t* data, const Shape& shape, Yuv& to) {
  copy_rows(data, shape.step, shape.size, to.y(), shape.size.width);
  for (std::uint32_t y = 0; y < to.chroma().height; ++y) {
    const std::uint8_t* const in = data + (shape.size.height + y) * shape.step;
    split_pairs(in, in, {}, shape.size.width, chroma_of(to, shape.swapped, y));
  }
}

void half_chroma_from_yuv(const YuvView& from, const Shape& shape, std::uint8_t* data) {
  copy_rows(from.y, from.y_step, shape.size, data, shape.step);
  for (std::uint32_t y = 0; y < (shape.size.height + 1) / 2; ++y)
    join_pairs(chroma_of(from, shape.swapped, y), {}, shape.size.width,
               data + (shape.size.height + y) * shape.step);
}

// A row of u and v takes two rows of the data.
void full_chroma_to_yuv(const std::uint8_t* data, const Shape& shape, Yuv& to) {
  const auto [width, height] = shape.size;
  copy_rows(data, shape.step, shape.size, to.y(), width);
  Bytes upper(std::size_t{2} * width), lower(upper.size());
  const auto read = [&](std::uint32_t y, Bytes& row) {
    const std::uint8_t* const in = data + (shape.size.height + std::size_t{2} * y) * shape.step;
    copy_rows(in, shape.step, {shape.size.width, 2}, row.data(), shape.size.width);
  };
  for (std::uint32_t y = 0; y < height; y += 2) {
    read(y, upper);
    read(std::min(y + 1, height - 1), lower);
    const Chroma out = chroma_of(to, shape.swapped, y / 2);
    for (std::uint32_t x = 0; x < to.chroma().width; ++x) {
      const std::size_t at = std::size_t{4} * x;
      const std::size_t next = 2 * x + 1 < width ? 2 : 0;
      out.u[x] = static_cast<std::uint8_t>(
          (upper[at] + upper[at + next] + lower[at] + lower[at + next] + 2) / 4);
      out.v[x] = static_cast<std::uint8_t>(
          (upper[at + 1] + upper[at + next + 1] + lower[at + 1] + lower[at + next + 1] + 2) / 4);
    }
  }
}

void full_chroma_from_yuv(const YuvView& from, const Shape& shape, std::uint8_t* data) {
  const auto [width, height] = shape.size;
  copy_rows(from.y, from.y_step, shape.size, data, shape.step);
  Bytes row(std::size_t{2} * width);
  for (std::uint32_t y = 0; y < height; ++y) {
    const ChromaRow in = chroma_of(from, shape.swapped, y / 2);
    for (std::uint32_t x = 0; x < width; ++x) {
      row[std::size_t{2} * x] = in.u[x / 2];
      row[std::size_t{2} * x + 1] = in.v[x / 2];
    }
    copy_rows(row.data(), width, {width, 2}, data + (height + std::size_t{2} * y) * shape.step,
              shape.step);
  }
}

// ---- half size

struct Plane {
  const std::uint8_t* bytes = nullptr;
  std::size_t step = 0;
  Size size;
};
Size chroma_of(Size size) {
  return {(size.width + 1) / 2, (size.height + 1) / 2};
}

void halve_plane(const Plane& from, std::uint8_t* to, std::size_t to_step) {
  for (std::uint32_t y = 0; y < from.size.height; y += 2) {
    const std::uint8_t* const upper = from.bytes + y * from.step;
    const std::uint8_t* const lower = y + 1 < from.size.height ? upper + from.step : upper;
    std::uint8_t* const out = to + y / 2 * to_step;
    const auto sum = [&](std::uint32_t a, std::uint32_t b) {
      return static_cast<std::uint8_t>((upper[a] + upper[b] + lower[a] + lower[b] + 2) / 4);
    };
    for (std::uint32_t x = 0; x < from.size.width / 2; ++x) out[x] = sum(2 * x, 2 * x + 1);
    const std::uint32_t last = from.size.width - 1;
    if (last % 2 == 0) out[last / 2] = sum(last, last);
  }
}

// Each value counts three quarters for the two next to it, and a quarter for those behind them.
void enlarge_plane(const Plane& from, Size size, std::uint8_t* to, std::size_t to_step) {
  // A value before the row and one behind it spare the ends a case of their own.
  std::vector<std::uint16_t> mixed(from.size.width + std::size_t{2});
  for (std::uint32_t y = 0; y < size.height; ++y) {
    const std::uint32_t near = y / 2;
    const std::uint32_t far =
        y % 2 != 0 ? std::min(near + 1, from.size.height - 1) : near - (near > 0 ? 1 : 0);
    const std::uint8_t* const near_row = from.bytes + near * from.step;
    const std::uint8_t* const far_row = from.bytes + far * from.step;
    for (std::uint32_t x = 0; x < from.size.width; ++x)
      mixed[x + 1] = static_cast<std::uint16_t>(3 * near_row[x] + far_row[x]);
    mixed.front() = mixed[1];
    mixed.back() = mixed[from.size.width];
    std::uint8_t* const out = to + y * to_step;
    for (std::uint32_t x = 0; x < size.width / 2; ++x) {
      out[2 * x] = static_cast<std::uint8_t>((3 * mixed[x + 1] + mixed[x] + 8) / 16);
      out[2 * x + 1] = static_cast<std::uint8_t>((3 * mixed[x + 1] + mixed[x + 2] + 8) / 16);
    }
    const std::uint32_t half = size.width / 2;
    if (size.width % 2 != 0)
      out[size.width - 1] = static_cast<std::uint8_t>((3 * mixed[half + 1] + mixed[half] + 8) / 16);
  }
}

// The luma of bayer is four planes, which do not mix.
std::uint32_t planes_of_luma(const Shape& shape) {
  return shape.arrangement == Arrangement::kBayer ? 2 : 1;
}

}  // namespace

void Yuv::resize(Size size) {
  if (size == size_) return;
  size_ = size;
  bytes_.resize(std::size_t{size.width} * size.height +
                std::size_t{2} * chroma().width * chroma().height);
}

YuvView Yuv::view() {
  return {size_, y(), u(), v(), size_.width, chroma().width};
}

void to_yuv(const std::uint8_t* data, const Shape& shape, Yuv& to) {
  to.resize(shape.coded(false));
  switch (shape.arrangement) {
    case Arrangement::kColours:
      if (shape.has_alpha())
        shape.swapped ? colours_to_yuv<4, 2>(data, shape, to)
                      : colours_to_yuv<4, 0>(data, shape, to);
      else
        shape.swapped ? colours_to_yuv<3, 2>(data, shape, to)
                      : colours_to_yuv<3, 0>(data, shape, to);
      return;
    case Arrangement::kGrey:
      copy_rows(data, shape.step, shape.size, to.y(), shape.size.width);
      return fill_chroma(to);
    case Arrangement::kBayer: return bayer_to_yuv(data, shape, to);
    case Arrangement::kYuyv: return packed_to_yuv(data, shape, 0, to);
    case Arrangement::kUyvy: return packed_to_yuv(data, shape, 1, to);
    case Arrangement::kHalfChroma: return half_chroma_to_yuv(data, shape, to);
    case Arrangement::kFullChroma: return full_chroma_to_yuv(data, shape, to);
    case Arrangement::kJpeg: return;  // JpegReader has written them
  }
}

void from_yuv(const YuvView& from, const Shape& shape, std::uint8_t* data) {
  switch (shape.arrangement) {
    case Arrangement::kColours:
      if (shape.has_alpha())
        shape.swapped ? colours_from_yuv<4, 2>(from, shape, data)
                      : colours_from_yuv<4, 0>(from, shape, data);
      else
        shape.swapped ? colours_from_yuv<3, 2>(from, shape, data)
                      : colours_from_yuv<3, 0>(from, shape, data);
      return;
    case Arrangement::kGrey: return copy_rows(from.y, from.y_step, shape.size, data, shape.step);
    case Arrangement::kBayer: return bayer_from_yuv(from, shape, data);
    case Arrangement::kYuyv: return packed_from_yuv(from, shape, 0, data);
    case Arrangement::kUyvy: return packed_from_yuv(from, shape, 1, data);
    case Arrangement::kHalfChroma: return half_chroma_from_yuv(from, shape, data);
    case Arrangement::kFullChroma: return full_chroma_from_yuv(from, shape, data);
    case Arrangement::kJpeg: return;  // JpegWriter reads them
  }
}

void halve(const YuvView& from, const Shape& shape, Yuv& to) {
  to.resize(shape.coded(true));
  const std::uint32_t planes = planes_of_luma(shape);
  const Size in{from.size.width / planes, from.size.height / planes};
  const Size out{to.size().width / planes, to.size().height / planes};
  const std::size_t to_step = to.size().width;
  for (std::uint32_t row = 0; row < planes; ++row)
    for (std::uint32_t column = 0; column < planes; ++column)
      halve_plane({from.y + row * in.height * from.y_step + column * in.width, from.y_step, in},
                  to.y() + row * out.height * to_step + std::size_t{column} * out.width, to_step);
  const Size chroma = chroma_of(from.size);
  if (planes > 1) return fill_chroma(to);
  halve_plane({from.u, from.uv_step, chroma}, to.u(), to.chroma().width);
  halve_plane({from.v, from.uv_step, chroma}, to.v(), to.chroma().width);
}

void enlarge(const YuvView& from, const Shape& shape, Yuv& to) {
  to.resize(shape.coded(false));
  const std::uint32_t planes = planes_of_luma(shape);
  const Size in{from.size.width / planes, from.size.height / planes};
  const Size out{to.size().width / planes, to.size().height / planes};
  const std::size_t to_step = to.size().width;
  for (std::uint32_t row = 0; row < planes; ++row)
    for (std::uint32_t column = 0; column < planes; ++column)
      enlarge_plane({from.y + row * in.height * from.y_step + column * in.width, from.y_step, in},
                    out, to.y() + row * out.height * to_step + std::size_t{column} * out.width,
                    to_step);
  const Size chroma = chroma_of(from.size);
  enlarge_plane({from.u, from.uv_step, chroma}, to.chroma(), to.u(), to.chroma().width);
  enlarge_plane({from.v, from.uv_step, chroma}, to.chroma(), to.v(), to.chroma().width);
}

bool is_opaque(const std::uint8_t* data, const Shape& shape) {
  if (!shape.has_alpha()) return true;
  for (std::uint32_t y = 0; y < shape.size.height; ++y) {
    const std::uint8_t* const row = data + y * shape.step;
    std::uint8_t all = 255;
    for (std::uint32_t x = 0; x < shape.size.width; ++x) all &= row[std::size_t{4} * x + 3];
    if (all != 255) return false;
  }
  return true;
}

}  // namespace connect_bridge::video
