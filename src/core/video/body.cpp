#include "core/video/body.hpp"

#include "core/base/byte_order.hpp"

namespace connect_bridge::video {
namespace {

constexpr std::uint8_t kVersion = 1;
constexpr std::uint8_t kBaseFlag = 1;
constexpr std::uint8_t kHalfFlag = 2;

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

}  // namespace

std::optional<PictureBody> read_body(ByteView body) {
  if (body.size() < kBodyHeadBytes || body[0] != kVersion || body[2] > kQuantiserMax ||
      (body[1] & ~(kBaseFlag | kHalfFlag)) != 0 || body[3] != 0)
    return std::nullopt;
  const auto prefix_bytes = get_le<std::uint32_t>(body, 4);
  if (prefix_bytes > body.size() - kBodyHeadBytes) return std::nullopt;
  PictureBody read;
  read.base = (body[1] & kBaseFlag) != 0;
  read.half = (body[1] & kHalfFlag) != 0;
  read.quantiser = body[2];
  read.prefix = body.subspan(kBodyHeadBytes, prefix_bytes);
  read.frame = body.subspan(kBodyHeadBytes + prefix_bytes);
  const auto image = media::image_layout_of_prefix(read.prefix);
  const auto shape = image ? shape_of(*image) : std::nullopt;
  if (!shape || !is_frame(read.frame, read.base, shape->coded(read.half))) return std::nullopt;
  read.shape = *shape;
  return read;
}

Bytes write_body(const PictureBody& body) {
  Bytes out;
  out.reserve(kBodyHeadBytes + body.prefix.size() + body.frame.size());
  out.push_back(kVersion);
  out.push_back(
      static_cast<std::uint8_t>((body.base ? kBaseFlag : 0) | (body.half ? kHalfFlag : 0)));
  out.push_back(body.quantiser);
  out.push_back(0);
  put_le(static_cast<std::uint32_t>(body.prefix.size()), out);
  out.insert(out.end(), body.prefix.begin(), body.prefix.end());
  out.insert(out.end(), body.frame.begin(), body.frame.end());
  return out;
}

std::optional<PictureSample> read_sample(ByteView raw) {
  const auto image = media::image_layout(raw);
  if (!image) return std::nullopt;
  const auto shape = shape_of(*image);
  if (!shape) return std::nullopt;
  return PictureSample{raw.first(image->data.begin),
                       raw.subspan(image->data.begin, image->data.bytes), *shape};
}

}  // namespace connect_bridge::video
