// Names of identities and groups from all login methods.
#pragma once

#include <algorithm>
#include <string>

#include "core/wire/text.hpp"

namespace connect_bridge {

inline constexpr std::size_t kIdentityNameBytesMax = 255;

// What is wrong with a name of an identity or group; empty: nothing.
[[nodiscard]] inline std::string name_problem(const std::string& name) {
  if (name.empty()) return "is empty";
  if (name.size() > kIdentityNameBytesMax) return "has more than 255 bytes";
  return is_text(name) ? "" : "has a control character or is not UTF-8";
}

}  // namespace connect_bridge
