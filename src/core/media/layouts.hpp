// The layouts of sensor_msgs Image, CompressedImage and PointCloud2 in a serialized sample
// (little-endian CDR). Nothing is allocated for a sample that does not agree with itself up to its
// last byte.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/base/bytes.hpp"

namespace connect_bridge::media {

// Where the data of a sample are, counted from its first byte.
struct DataPlace {
  std::uint32_t begin = 0;
  std::uint32_t bytes = 0;
  [[nodiscard]] std::uint32_t end() const { return begin + bytes; }
};

// All views point into the sample.
struct ImageLayout {
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::uint32_t step = 0;  // bytes of a row
  std::string_view encoding;
  bool big_endian = false;
  DataPlace data;
};
// nullopt: the sample is no Image, or `data` is no whole number of rows.
[[nodiscard]] std::optional<ImageLayout> image_layout(ByteView raw);
// The same of the sample's beginning alone: it ends where the data begin.
[[nodiscard]] std::optional<ImageLayout> image_layout_of_prefix(ByteView prefix);

// The data of a CompressedImage; nullopt: the sample is none.
[[nodiscard]] std::optional<DataPlace> compressed_data(ByteView raw);
// The beginning of one: it ends where the length of the data lies.
[[nodiscard]] bool is_compressed_prefix(ByteView prefix);

struct CloudField {
  std::string_view name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;  // of sensor_msgs/PointField
  std::uint32_t count = 0;
};
enum Datatype : std::uint8_t { kFloat32 = 7, kFloat64 = 8 };
// Bytes of one value; 0: there is no such type.
[[nodiscard]] std::uint32_t bytes_of_datatype(std::uint8_t datatype);

struct CloudLayout {
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::uint32_t size_at = 0;  // height, then width
  std::vector<CloudField> fields;
  bool big_endian = false;
  std::uint32_t point_step = 0;
  std::uint32_t row_step = 0;
  std::uint32_t row_step_at = 0;
  DataPlace data;  // a whole number of points; `is_dense` follows
  [[nodiscard]] std::uint32_t points() const { return data.bytes / point_step; }
  // Rows follow each other, and there are no other points than the rows'.
  [[nodiscard]] bool is_tight() const;
};
// nullopt: the sample is no PointCloud2, or a field is not within a point.
[[nodiscard]] std::optional<CloudLayout> cloud_layout(ByteView raw);

}  // namespace connect_bridge::media
