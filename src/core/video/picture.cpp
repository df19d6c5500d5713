#include "core/video/picture.hpp"

#include "core/video/body.hpp"
#include "core/video/jpeg.hpp"
#include "core/video/vp8.hpp"

namespace connect_bridge::video {
namespace {

// Measured with libvpx 1.12, for each pixel of the frame.
constexpr std::uint64_t kEncoderBytes = 48;
constexpr std::uint64_t kDecoderBytes = 12;
// Planes of a JPEG without subsampling, and coefficients of a progressive one.
constexpr std::uint64_t kJpegReaderBytes = 9;
constexpr std::uint64_t kJpegWriterBytes = 5;     // even planes, and the most that is written
constexpr std::uint64_t kCodecBytes = 256 << 10;  // besides, at the least

constexpr std::string_view kImage = "sensor_msgs/msg/Image";
constexpr std::string_view kCompressed = "sensor_msgs/msg/CompressedImage";

std::uint64_t codec_bytes(const Shape& shape, std::uint64_t for_pixel) {
  const Size size = shape.coded(false);
  return kCodecBytes + for_pixel * size.width * size.height;
}

}  // namespace

bool available() {
  return has_vp8() && has_jpeg();
}

std::optional<PictureFacts> facts_of(ByteView body) {
  const auto read = read_body(body);
  if (!read) return std::nullopt;
  return PictureFacts{
      read->base,
      read->half,
      read->shape.is_jpeg(),
      read->quantiser,
      read->raw_bytes(),
      codec_bytes(read->shape, kDecoderBytes + (read->shape.is_jpeg() ? kJpegWriterBytes : 0))};
}

bool has_pictures(std::string_view type) {
  return type == kImage || type == kCompressed;
}

bool is_picture(ByteView raw) {
  return read_sample(raw).has_value();
}

std::uint64_t picture_bytes(std::string_view type, ByteView raw) {
  const auto sample = read_sample(raw);
  const bool fits = sample && type == (sample->shape.is_jpeg() ? kCompressed : kImage);
  return fits ? sample->prefix.size() + sample->shape.data_bytes() : 0;
}

std::uint64_t encoder_bytes(ByteView raw) {
  const auto sample = read_sample(raw);
  if (!sample) return 0;
  return codec_bytes(sample->shape,
                     kEncoderBytes + (sample->shape.is_jpeg() ? kJpegReaderBytes : 0));
}

}  // namespace connect_bridge::video
