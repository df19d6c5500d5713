#include "core/wire/text.hpp"

#include <cstdint>

namespace connect_bridge {
namespace {

// Other ends of lines (U+2028, U+2029), and characters that turn the order of their neighbours
// (U+202A to U+202E, U+2066 to U+2069). With them a line of a log would look like two, or like
// another.
bool misleads(std::uint8_t second, std::uint8_t third) {
  return (second == 0x80 && third >= 0xa8 && third <= 0xae) ||
         (second == 0x81 && third >= 0xa6 && third <= 0xa9);
}

// Size of the first character of `bytes` (which is not empty), in bytes; 0: it is not valid text.
std::size_t character_bytes(std::string_view bytes) {
  const auto at = [bytes](std::size_t i) { return static_cast<std::uint8_t>(bytes[i]); };
  const std::uint8_t first = at(0);
  if (first < 0x80) return first >= 0x20 && first != 0x7f ? 1 : 0;
  const std::size_t size = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || bytes.size() < size) return 0;
  // The second byte's range excludes overlong forms, surrogates, values beyond U+10FFFF, and the C1
  // control characters (0xc2 0x80 to 0x9f).
  std::uint8_t low = 0x80;
  std::uint8_t high = 0xbf;
  if (first == 0xc2 || first == 0xe0) low = 0xa0;
  if (first == 0xed) high = 0x9f;
  if (first == 0xf0) low = 0x90;
  if (first == 0xf4) high = 0x8f;
  if (at(1) < low || at(1) > high) return 0;
  for (std::size_t i = 2; i < size; ++i) {
    if ((at(i) & 0xc0) != 0x80) return 0;
  }
  return first == 0xe2 && misleads(at(1), at(2)) ? 0 : size;
}

}  // namespace

bool is_text(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::size_t size = character_bytes(bytes);
    if (size == 0) return false;
    bytes.remove_prefix(size);
  }
  return true;
}

std::string to_text(std::string_view bytes, std::size_t bytes_max) {
  std::string text;
  while (!bytes.empty()) {
    const std::size_t size = character_bytes(bytes);
    const std::string_view character = size == 0 ? std::string_view{"?"} : bytes.substr(0, size);
    if (text.size() + character.size() > bytes_max) break;
    text += character;
    // One byte is replaced at a time, so that valid characters behind it stay.
    bytes.remove_prefix(size == 0 ? 1 : size);
  }
  return text;
}

}  // namespace connect_bridge
