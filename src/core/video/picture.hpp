// Pictures of cameras as the wire carries them: one VP8 frame behind the beginning of the sample
// (docs/protocol.md section 6, "Pictures"). All functions are cheap enough for the loop.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/bytes.hpp"

namespace connect_bridge::video {

// The build has libvpx and libturbojpeg. Without them no picture is encoded or decoded.
[[nodiscard]] bool available();

// The facts that a body states about itself.
struct PictureFacts {
  bool base = false;                // the picture refers to no other one
  bool half = false;                // half width and height
  bool jpeg = false;                // of a CompressedImage
  std::uint8_t quantiser = 0;       // libvpx's index, 0 to 63
  std::uint64_t raw_bytes = 0;      // of a JPEG's sample the most
  std::uint64_t decoder_bytes = 0;  // of memory that decoding such pictures takes
};
// The prefix, the sizes and the head of the frame are compared; nullopt: the body is malformed.
[[nodiscard]] std::optional<PictureFacts> facts_of(ByteView body);

// Messages of the type may become pictures.
[[nodiscard]] bool has_pictures(std::string_view type);

// The sample is an Image that may become a lossy picture, by its encoding and its size, or a
// CompressedImage with a JPEG. Whether an alpha channel is opaque everywhere, and whether the JPEG
// can be decoded, is looked at by the encoder.
[[nodiscard]] bool is_picture(ByteView raw);
// The raw_bytes of a picture of the sample; 0: it is none, or not of this type.
[[nodiscard]] std::uint64_t picture_bytes(std::string_view type, ByteView raw);

// Bytes of memory that encoding pictures of such samples takes; 0: it is no picture.
[[nodiscard]] std::uint64_t encoder_bytes(ByteView raw);

}  // namespace connect_bridge::video
