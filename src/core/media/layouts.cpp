#include "core/media/layouts.hpp"

#include "core/base/cdr.hpp"

namespace connect_bridge::media {
namespace {

constexpr std::size_t kRestMax = 3;  // a middleware may fill the sample up to a multiple of four
constexpr std::uint32_t kFieldsMax = 128;

std::uint32_t place_of(ByteView part, ByteView raw) {
  return static_cast<std::uint32_t>(part.data() - raw.data());
}

// std_msgs/Header: its stamp of two numbers, its frame.
bool read_header(CdrReader& reader) {
  return reader.u32() && reader.u32() && reader.string();
}

// An Image up to the length of its data.
std::optional<ImageLayout> read_image(CdrReader& reader, ByteView raw) {
  if (!read_header(reader)) return std::nullopt;
  const auto height = reader.u32();
  const auto width = reader.u32();
  const auto encoding = reader.string();
  const auto big_endian = reader.u8();
  const auto step = reader.u32();
  const auto bytes = reader.u32();
  if (!height || !width || !encoding || !big_endian || !step || !bytes) return std::nullopt;
  if (*height == 0 || *width == 0 || *step == 0 || *bytes % *step != 0) return std::nullopt;
  return ImageLayout{*height,   *width,           *step,
                     *encoding, *big_endian != 0, {place_of(reader.rest(), raw), *bytes}};
}

// A CompressedImage up to the length of its data: its header and its format.
bool read_compressed(CdrReader& reader) {
  return read_header(reader) && reader.string();
}

bool read_field(CdrReader& reader, CloudField& field) {
  const auto name = reader.string();
  const auto offset = reader.u32();
  const auto datatype = reader.u8();
  const auto count = reader.u32();
  if (!name || !offset || !datatype || !count) return false;
  field = {*name, *offset, *datatype, *count};
  return true;
}

bool fits(const CloudField& field, std::uint32_t point_step) {
  const std::uint32_t bytes = bytes_of_datatype(field.datatype);
  const std::uint64_t end = field.offset + std::uint64_t{bytes} * field.count;
  return bytes > 0 && end <= point_step;
}

}  // namespace

std::uint32_t bytes_of_datatype(std::uint8_t datatype) {
  switch (datatype) {
    case 1:
    case 2: return 1;
    case 3:
    case 4: return 2;
    case 5:
    case 6:
    case kFloat32: return 4;
    case kFloat64: return 8;
    default: return 0;
  }
}

bool CloudLayout::is_tight() const {
  return std::uint64_t{width} * point_step == row_step &&
         std::uint64_t{height} * row_step == data.bytes;
}

std::optional<ImageLayout> image_layout(ByteView raw) {
  CdrReader reader(raw);
  const auto image = read_image(reader, raw);
  if (!image || reader.rest().size() < image->data.bytes ||
      reader.rest().size() - image->data.bytes > kRestMax)
    return std::nullopt;
  return image;
}

std::optional<ImageLayout> image_layout_of_prefix(ByteView prefix) {
  CdrReader reader(prefix);
  const auto image = read_image(reader, prefix);
  if (!image || !reader.rest().empty()) return std::nullopt;
  return image;
}

std::optional<DataPlace> compressed_data(ByteView raw) {
  CdrReader reader(raw);
  if (!read_compressed(reader)) return std::nullopt;
  const auto data = reader.octets();
  if (!data || reader.rest().size() > kRestMax) return std::nullopt;
  return DataPlace{place_of(*data, raw), static_cast<std::uint32_t>(data->size())};
}

bool is_compressed_prefix(ByteView prefix) {
  CdrReader reader(prefix);
  constexpr std::size_t kLengthBytes = 4;
  return read_compressed(reader) && reader.rest().size() < kLengthBytes &&
         (prefix.size() - kCdrHeaderBytes) % kLengthBytes == 0;
}

std::optional<CloudLayout> cloud_layout(ByteView raw) {
  CdrReader reader(raw);
  if (!read_header(reader)) return std::nullopt;
  CloudLayout layout;
  const auto height = reader.u32();
  if (!height) return std::nullopt;  // nothing lies before the rest
  layout.size_at = place_of(reader.rest(), raw) - 4;
  const auto width = reader.u32();
  const auto fields = reader.u32();
  if (!width || !fields || *fields > kFieldsMax) return std::nullopt;
  for (std::uint32_t i = 0; i < *fields; ++i)
    if (!read_field(reader, layout.fields.emplace_back())) return std::nullopt;
  const auto big_endian = reader.u8();
  const auto point_step = reader.u32();
  const auto row_step = reader.u32();
  if (!row_step) return std::nullopt;
  layout.row_step_at = place_of(reader.rest(), raw) - 4;
  const auto data = reader.octets();
  const auto is_dense = reader.u8();
  if (!big_endian || !point_step || !data || !is_dense || reader.rest().size() > kRestMax)
    return std::nullopt;
  if (*point_step == 0 || data->empty() || data->size() % *point_step != 0) return std::nullopt;
  for (const CloudField& field : layout.fields)
    if (!fits(field, *point_step)) return std::nullopt;
  layout.height = *height;
  layout.width = *width;
  layout.big_endian = *big_endian != 0;
  layout.point_step = *point_step;
  layout.row_step = *row_step;
  layout.data = {place_of(*data, raw), static_cast<std::uint32_t>(data->size())};
  return layout;
}

}  // namespace connect_bridge::media
