// Samples of sensor_msgs Image, CompressedImage and PointCloud2 as a publisher serializes them.
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/byte_order.hpp"
#include "core/base/bytes.hpp"

namespace connect_bridge::media {

// Plain CDR; what the project's CdrWriter does not write is written here.
class SampleWriter {
 public:
  SampleWriter& u8(std::uint8_t value) { return number(value); }
  SampleWriter& u32(std::uint32_t value) { return number(value); }
  SampleWriter& text(std::string_view value) {
    u32(static_cast<std::uint32_t>(value.size() + 1));
    bytes.insert(bytes.end(), value.begin(), value.end());
    bytes.push_back(0);
    return *this;
  }
  SampleWriter& octets(ByteView value) {
    u32(static_cast<std::uint32_t>(value.size()));
    bytes.insert(bytes.end(), value.begin(), value.end());
    return *this;
  }

  Bytes bytes{0, 1, 0, 0};

 private:
  template <class T>
  SampleWriter& number(T value) {
    while ((bytes.size() - 4) % sizeof(T) != 0) bytes.push_back(0);
    put_le(value, bytes);
    return *this;
  }
};

struct TestImage {
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::string_view encoding;
  std::uint32_t step = 0;
  bool big_endian = false;
  Bytes data;
};

inline Bytes image_sample(const TestImage& image) {
  SampleWriter out;
  out.u32(12).u32(34).text("camera").u32(image.height).u32(image.width).text(image.encoding);
  out.u8(image.big_endian ? 1 : 0).u32(image.step).octets(image.data);
  return out.bytes;
}

inline Bytes compressed_sample(ByteView data, std::string_view format) {
  return SampleWriter().u32(12).u32(34).text("camera").text(format).octets(data).bytes;
}

struct TestJpeg {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint8_t components = 3;
  std::uint8_t frame = 0xc0;  // the marker of its frame
  std::uint8_t bits = 8;
};

// A JPEG up to the end of its frame's head, with a comment before that.
inline Bytes jpeg_beginning(const TestJpeg& jpeg) {
  Bytes out{0xff, 0xd8, 0xff, 0xfe, 0, 4, 'h', 'i', 0xff, jpeg.frame, 0};
  out.push_back(static_cast<std::uint8_t>(8 + 3 * jpeg.components));
  out.push_back(jpeg.bits);
  for (const std::uint32_t side : {jpeg.height, jpeg.width})
    for (const std::uint32_t part : {side >> 8U, side & 0xffU})
      out.push_back(static_cast<std::uint8_t>(part));
  out.push_back(jpeg.components);
  out.resize(out.size() + std::size_t{3} * jpeg.components);
  return out;
}

struct TestField {
  std::string_view name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 7;
  std::uint32_t count = 1;
};

struct TestCloud {
  std::uint32_t height = 1;
  std::uint32_t width = 0;
  std::vector<TestField> fields = {};
  std::uint32_t point_step = 16;
  std::uint32_t row_step = 0;
  Bytes data = {};
  bool big_endian = false;
  std::uint8_t is_dense = 0;
};

inline Bytes cloud_sample(const TestCloud& cloud) {
  SampleWriter out;
  out.u32(12).u32(34).text("lidar").u32(cloud.height).u32(cloud.width);
  out.u32(static_cast<std::uint32_t>(cloud.fields.size()));
  for (const TestField& field : cloud.fields)
    out.text(field.name).u32(field.offset).u8(field.datatype).u32(field.count);
  out.u8(cloud.big_endian ? 1 : 0).u32(cloud.point_step).u32(cloud.row_step);
  out.octets(cloud.data).u8(cloud.is_dense);
  return out.bytes;
}

inline const std::vector<TestField> kXyzi{{"x", 0}, {"y", 4}, {"z", 8}, {"intensity", 12}};

inline void set_float(float value, Bytes& data, std::size_t at) {
  set_le(std::bit_cast<std::uint32_t>(value), data, at);
}
inline float float_at(ByteView data, std::size_t at) {
  return std::bit_cast<float>(get_le<std::uint32_t>(data, at));
}

}  // namespace connect_bridge::media
