// Text from and for peers. Logs and screens show it, so control characters are not allowed in it.
// docs/protocol.md section "Conventions".
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace connect_bridge {

// Valid UTF-8 (RFC 3629) without control characters (U+0000 to U+001F, U+007F to U+009F), other
// ends of lines (U+2028, U+2029) and changes of direction (U+202A to U+202E, U+2066 to U+2069).
[[nodiscard]] bool is_text(std::string_view bytes);

// Turns `bytes` into text of at most `bytes_max` bytes: invalid bytes become '?', and text that is
// too long is cut between two characters. For texts for people (a reason, an identity), not for
// names.
[[nodiscard]] std::string to_text(std::string_view bytes, std::size_t bytes_max);

// A type hash from a peer or a node, for the log, cut to the length of a REP-2016 hash. Such a hash
// is shown whole, as `ros2 topic info --verbose` shows it.
[[nodiscard]] inline std::string shown_hash(std::string_view hash) {
  constexpr std::size_t kHashBytes = 71;  // "RIHS01_" and 64 digits
  return to_text(hash, kHashBytes);
}

}  // namespace connect_bridge
