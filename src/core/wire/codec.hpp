// The compression of a message's body.
#pragma once

#include <compare>
#include <cstdint>

namespace connect_bridge {

// A message of kZstdBase or kZstdDelta becomes the base of its origin. The body of a kZstdDelta
// refers to the previous base, and kPictureDelta to the previous picture (docs/protocol.md section
// 6). Those from kPictureBase on are sent only where the demand names them (Decodes).
enum class Codec : std::uint8_t {
  kNone = 0,
  kLz4 = 1,
  kZstd = 2,
  kZstdBase = 3,
  kZstdDelta = 4,
  kPictureBase = 5,
  kPictureDelta = 6,
  kCloud = 7,
  kPlanes = 8
};

// Largest base (raw), and the limit for all bases of a link. Each base counts kBaseOverheadBytes
// more (docs/protocol.md section 12).
inline constexpr std::uint32_t kBaseBytesMax = 32 << 10;
inline constexpr std::uint64_t kBasesBytesMax = 8 << 20;
inline constexpr std::uint64_t kBaseOverheadBytes = 256;

constexpr bool makes_base(Codec codec) {
  return codec == Codec::kZstdBase || codec == Codec::kZstdDelta;
}

constexpr bool is_vp8(Codec codec) {
  return codec == Codec::kPictureBase || codec == Codec::kPictureDelta;
}

// An upper bound for the body that a codec makes of so many bytes: lz4 adds up to 1/255 and 16
// bytes, zstd 1/256 and 64. A receiver's work grows with the bytes that it gets, so it refuses
// larger bodies (docs/protocol.md section 6).
constexpr std::uint64_t compressed_bytes_max(std::uint32_t raw_bytes) {
  return raw_bytes + std::uint64_t{raw_bytes} / 128 + 128;
}

struct Compression {
  Codec codec = Codec::kNone;
  int level = 3;           // zstd only: 1 to 19
  bool automatic = false;  // only if it makes delivery faster; a rule has no codec then
  // kCloud only, in micrometres. 0: all is exact; no point is left out.
  std::uint32_t step_um = 0;
  std::uint32_t grid_um = 0;
  [[nodiscard]] constexpr bool loses() const { return step_um > 0 || grid_um > 0; }
  auto operator<=>(const Compression&) const = default;
};

}  // namespace connect_bridge
