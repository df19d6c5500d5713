// The golden bytes of tests/vectors, shared with everybody who writes a peer.
#pragma once

#include <string>
#include <string_view>

#include "core/base/bytes.hpp"
#include "core/base/hex.hpp"
#include "core/base/json.hpp"
#include "unit/source_text.hpp"

namespace connect_bridge {

inline Json read_vectors(const std::string& name) {
  return Json::parse(test::source_text("tests/vectors/" + name));
}

// Spaces are skipped.
inline Bytes from_hex(std::string_view hex) {
  Bytes bytes;
  std::string digits;
  for (const char c : hex) {
    if (c == ' ') continue;
    digits += c;
    if (digits.size() == 2) {
      bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits, nullptr, 16)));
      digits.clear();
    }
  }
  return bytes;
}

}  // namespace connect_bridge
