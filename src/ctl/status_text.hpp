// Reads a status as JSON, which anybody may have sent.
#pragma once

#include <cstddef>
#include <string_view>

#include "core/base/json.hpp"

namespace connect_bridge {

inline constexpr std::size_t kStatusDepthMax = 8;  // as in a control message
inline constexpr std::size_t kStatusValuesMax = 2'000'000;
inline constexpr std::size_t kStatusBytesMax = 64 << 20;

// Reads a status. Null: the text is no JSON object, or beyond a limit; then it was scanned, and no
// tree of it was built.
[[nodiscard]] Json read_status(std::string_view text);
// The same, with members in the order of the text.
[[nodiscard]] OrderedJson read_status_in_order(std::string_view text);

}  // namespace connect_bridge
