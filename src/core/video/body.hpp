// The body of a picture, as docs/protocol.md section 6 has it in "Pictures".
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/bytes.hpp"
#include "core/video/shape.hpp"

namespace connect_bridge::video {

// All views point into the body.
struct PictureBody {
  bool base = false;
  bool half = false;
  std::uint8_t quantiser = 0;
  ByteView prefix;  // the sample up to its data, of a JPEG up to their length
  ByteView frame;
  Shape shape;
  // The bytes of the sample, of a JPEG the most that it may have.
  [[nodiscard]] std::size_t raw_bytes() const { return prefix.size() + shape.data_bytes(); }
};

// nullopt: the body disagrees with itself, in its prefix, or in the head of its frame.
[[nodiscard]] std::optional<PictureBody> read_body(ByteView body);
[[nodiscard]] Bytes write_body(const PictureBody& body);

inline constexpr std::size_t kBodyHeadBytes = 8;
inline constexpr std::size_t kJpegSizeBytes = 4;  // behind it, for a JPEG
inline constexpr std::uint8_t kQuantiserMax = 63;

// The sample of an Image that may be a picture, or of a CompressedImage with a JPEG, without what a
// middleware pads it with. nullopt for others.
struct PictureSample {
  ByteView prefix;
  ByteView data;
  Shape shape;
};
[[nodiscard]] std::optional<PictureSample> read_sample(ByteView raw);

}  // namespace connect_bridge::video
