// The text of a status as JSON, whoever has sent it.
#pragma once

#include <cstddef>
#include <string_view>

#include "core/base/json.hpp"

namespace connect_bridge {

inline constexpr std::size_t kStatusDepthMax = 8;  // as a control message
inline constexpr std::size_t kStatusValuesMax = 2'000'000;
inline constexpr std::size_t kStatusBytesMax = 64 << 20;

// Null: it is no JSON object, or beyond a limit. Then it has cost a look at its bytes, and no
// memory.
[[nodiscard]] Json read_status(std::string_view text);
// Members in the order of the text.
[[nodiscard]] OrderedJson read_status_in_order(std::string_view text);

}  // namespace connect_bridge
