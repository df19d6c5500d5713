// Little-endian numbers in byte sequences, independent of the host. docs/protocol.md section
// "Conventions".
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "core/base/bytes.hpp"

namespace connect_bridge {

// `bytes` must hold at least `offset + sizeof(T)` bytes.
template <std::integral T>
[[nodiscard]] T get_le(ByteView bytes, std::size_t offset) {
  using U = std::make_unsigned_t<T>;
  U value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value = static_cast<U>(value | static_cast<U>(static_cast<U>(bytes[offset + i]) << (8 * i)));
  }
  return static_cast<T>(value);
}

// `bytes` must have room for `offset + sizeof(T)` bytes.
template <std::integral T>
void set_le(T value, std::span<std::uint8_t> bytes, std::size_t offset) {
  const auto bits = static_cast<std::make_unsigned_t<T>>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    bytes[offset + i] = static_cast<std::uint8_t>(bits >> (8 * i));
  }
}

template <std::integral T>
void put_le(T value, Bytes& out) {
  std::array<std::uint8_t, sizeof(T)> bytes{};
  set_le(value, bytes, 0);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

}  // namespace connect_bridge
