// An array with one element for each value of an enum.
#pragma once

#include <array>
#include <cstddef>

namespace connect_bridge {

// The enumerators of `Key` are 0 to kSize - 1.
template <class Key, class Value, std::size_t kSize>
struct EnumArray {
  std::array<Value, kSize> values{};

  [[nodiscard]] Value& operator[](Key key) { return values.at(static_cast<std::size_t>(key)); }
  [[nodiscard]] const Value& operator[](Key key) const {
    return values.at(static_cast<std::size_t>(key));
  }
  bool operator==(const EnumArray&) const = default;
};

}  // namespace connect_bridge
