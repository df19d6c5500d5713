// A hash that is the same in every process, and no secret: FNV-1a with 64 bits.
#pragma once

#include <cstdint>
#include <string_view>

namespace connect_bridge {

inline constexpr std::uint64_t kFnvBasis = 14695981039346656037ULL;

// `hash`: kFnvBasis, or what came before.
[[nodiscard]] constexpr std::uint64_t fnv1a(std::string_view text, std::uint64_t hash = kFnvBasis) {
  for (const char c : text) hash = (hash ^ static_cast<std::uint8_t>(c)) * 1099511628211ULL;
  return hash;
}

}  // namespace connect_bridge
