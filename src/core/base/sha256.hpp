// SHA-256 (FIPS 180-4).
#pragma once

#include <array>
#include <cstdint>

#include "core/base/bytes.hpp"

namespace connect_bridge {

using Digest = std::array<std::uint8_t, 32>;

[[nodiscard]] Digest sha256(ByteView bytes);

}  // namespace connect_bridge
