#include "core/video/picture.hpp"

#include "core/video/body.hpp"
#include "core/video/vp8.hpp"

namespace connect_bridge::video {
namespace {

// Measured with libvpx 1.12, for each pixel of the frame.
constexpr std::uint64_t kEncoderBytes = 48;
constexpr std::uint64_t kDecoderBytes = 12;
constexpr std::uint64_t kCodecBytes = 256 << 10;  // besides, at the least

std::uint64_t codec_bytes(const Shape& shape, std::uint64_t for_pixel) {
  const Size size = shape.coded(false);
  return kCodecBytes + for_pixel * size.width * size.height;
}

}  // namespace

bool available() {
  return has_vp8();
}

std::optional<PictureFacts> facts_of(ByteView body) {
  const auto read = read_body(body);
  if (!read) return std::nullopt;
  return PictureFacts{read->base, read->half, read->quantiser, read->raw_bytes(),
                      codec_bytes(read->shape, kDecoderBytes)};
}

bool is_picture(ByteView raw) {
  return read_sample(raw).has_value();
}

std::uint64_t encoder_bytes(ByteView raw) {
  const auto sample = read_sample(raw);
  return sample ? codec_bytes(sample->shape, kEncoderBytes) : 0;
}

}  // namespace connect_bridge::video
