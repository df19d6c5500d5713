#include "core/video/body.hpp"

#include "core/base/byte_order.hpp"
#include "core/video/jpeg_head.hpp"

namespace connect_bridge::video {
namespace {

constexpr std::uint8_t kVersion = 1;
constexpr std::uint8_t kBaseFlag = 1;
constexpr std::uint8_t kHalfFlag = 2;
constexpr std::uint8_t kJpegFlag = 4;
constexpr std::uint8_t kGreyFlag = 8;  // of a JPEG
constexpr std::size_t kDataLengthBytes = 4;

// The uncompressed head of a frame (RFC 6386 section 9.1): version 0, shown, its first partition
// within it; a key frame has exactly this size and is not to be scaled.
bool is_frame(ByteView frame, bool base, Size size) {
  constexpr std::size_t kTagBytes = 3, kKeyHeadBytes = 10;
  const std::size_t head = base ? kKeyHeadBytes : kTagBytes;
  if (frame.size() <= head) return false;
  const std::uint32_t tag = frame[0] | std::uint32_t{frame[1]} << 8 | std::uint32_t{frame[2]} << 16;
  const bool key = (tag & 1U) == 0;
  const bool shown_by_version_0 = (tag >> 1 & 0xfU) == 8;
  if (key != base || !shown_by_version_0 || tag >> 5 > frame.size() - head) return false;
  return !base || (frame[3] == 0x9d && frame[4] == 0x01 && frame[5] == 0x2a &&
                   get_le<std::uint16_t>(frame, 6) == size.width &&
                   get_le<std::uint16_t>(frame, 8) == size.height);
}

std::optional<Shape> shape_of_image(ByteView prefix) {
  const auto image = media::image_layout_of_prefix(prefix);
  return image ? shape_of(*image) : std::nullopt;
}

// A prefix of a CompressedImage does not have the size of its picture: the head has it.
std::optional<Shape> shape_of_compressed(ByteView prefix, ByteView size, bool is_grey) {
  if (!media::is_compressed_prefix(prefix)) return std::nullopt;
  return shape_of_jpeg({get_le<std::uint16_t>(size, 0), get_le<std::uint16_t>(size, 2)}, is_grey,
                       prefix.size());
}

}  // namespace

std::optional<PictureBody> read_body(ByteView body) {
  if (body.size() < kBodyHeadBytes || body[0] != kVersion || body[2] > kQuantiserMax ||
      (body[1] & ~(kBaseFlag | kHalfFlag | kJpegFlag | kGreyFlag)) != 0 || body[3] != 0)
    return std::nullopt;
  const bool jpeg = (body[1] & kJpegFlag) != 0, grey = (body[1] & kGreyFlag) != 0;
  const std::size_t head_bytes = kBodyHeadBytes + (jpeg ? kJpegSizeBytes : 0);
  const auto prefix_bytes = get_le<std::uint32_t>(body, 4);
  if ((grey && !jpeg) || body.size() < head_bytes || prefix_bytes > body.size() - head_bytes)
    return std::nullopt;
  PictureBody read;
  read.base = (body[1] & kBaseFlag) != 0;
  read.half = (body[1] & kHalfFlag) != 0;
  read.quantiser = body[2];
  read.prefix = body.subspan(head_bytes, prefix_bytes);
  read.frame = body.subspan(head_bytes + prefix_bytes);
  const auto shape = jpeg ? shape_of_compressed(read.prefix, body.subspan(kBodyHeadBytes), grey)
                          : shape_of_image(read.prefix);
  if (!shape || !is_frame(read.frame, read.base, shape->coded(read.half))) return std::nullopt;
  read.shape = *shape;
  return read;
}

Bytes write_body(const PictureBody& body) {
  const Shape& shape = body.shape;
  Bytes out;
  out.reserve(kBodyHeadBytes + kJpegSizeBytes + body.prefix.size() + body.frame.size());
  out.push_back(kVersion);
  out.push_back(static_cast<std::uint8_t>(
      (body.base ? kBaseFlag : 0) | (body.half ? kHalfFlag : 0) |
      (shape.is_jpeg() ? kJpegFlag : 0) | (shape.is_grey_jpeg() ? kGreyFlag : 0)));
  out.push_back(body.quantiser);
  out.push_back(0);
  put_le(static_cast<std::uint32_t>(body.prefix.size()), out);
  if (shape.is_jpeg()) {
    put_le(static_cast<std::uint16_t>(shape.size.width), out);
    put_le(static_cast<std::uint16_t>(shape.size.height), out);
  }
  out.insert(out.end(), body.prefix.begin(), body.prefix.end());
  out.insert(out.end(), body.frame.begin(), body.frame.end());
  return out;
}

namespace {

std::optional<PictureSample> read_image(ByteView raw) {
  const auto image = media::image_layout(raw);
  if (!image) return std::nullopt;
  const auto shape = shape_of(*image);
  if (!shape) return std::nullopt;
  return PictureSample{raw.first(image->data.begin),
                       raw.subspan(image->data.begin, image->data.bytes), *shape};
}

std::optional<PictureSample> read_compressed(ByteView raw) {
  const auto place = media::compressed_data(raw);
  if (!place) return std::nullopt;
  const ByteView data = raw.subspan(place->begin, place->bytes);
  const auto head = jpeg_head(data);
  if (!head) return std::nullopt;
  const ByteView prefix = raw.first(place->begin - kDataLengthBytes);
  const auto shape = shape_of_jpeg(head->size, head->is_grey, prefix.size());
  if (!shape) return std::nullopt;
  return PictureSample{prefix, data, *shape};
}

}  // namespace

std::optional<PictureSample> read_sample(ByteView raw) {
  const auto image = read_image(raw);
  return image ? image : read_compressed(raw);
}

}  // namespace connect_bridge::video
