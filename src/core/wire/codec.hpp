// The compression of a message's body.
#pragma once

#include <compare>
#include <cstdint>

namespace connect_bridge {

// A message of the last two is kept as the base of its origin; the body of a kZstdDelta refers to
// the base before it (docs/protocol.md section 6).
enum class Codec : std::uint8_t { kNone = 0, kLz4 = 1, kZstd = 2, kZstdBase = 3, kZstdDelta = 4 };

// Of a base (raw), and of all bases of a link; each counts kBaseOverheadBytes more. Section 12.
inline constexpr std::uint32_t kBaseBytesMax = 32 << 10;
inline constexpr std::uint64_t kBasesBytesMax = 8 << 20;
inline constexpr std::uint64_t kBaseOverheadBytes = 256;

constexpr bool makes_base(Codec codec) {
  return codec == Codec::kZstdBase || codec == Codec::kZstdDelta;
}

struct Compression {
  Codec codec = Codec::kNone;
  int level = 3;           // zstd only: 1 to 19
  bool automatic = false;  // where delivery gets sooner; a rule has no codec then
  auto operator<=>(const Compression&) const = default;
};

}  // namespace connect_bridge
