// The compression of a message's body.
#pragma once

#include <compare>
#include <cstdint>

namespace connect_bridge {

enum class Codec : std::uint8_t { kNone = 0, kLz4 = 1, kZstd = 2 };

struct Compression {
  Codec codec = Codec::kNone;
  int level = 3;  // zstd only: 1 to 19
  auto operator<=>(const Compression&) const = default;
};

}  // namespace connect_bridge
