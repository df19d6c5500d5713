// A check of JSON text before it is parsed.
#pragma once

#include <string_view>

#include "core/base/result.hpp"

namespace connect_bridge {

// Refuses too deep nesting and too many values before a parser allocates memory for them. It does
// not parse JSON: in valid JSON it counts exactly, and the parser refuses the rest.
[[nodiscard]] Result<Nothing> check_control_shape(std::string_view text);

}  // namespace connect_bridge
