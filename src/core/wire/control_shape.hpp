// A look at JSON text before a parser sees it.
#pragma once

#include <string_view>

#include "core/base/result.hpp"

namespace connect_bridge {

// Refuses nesting and numbers of values that are beyond the limits, before a parser allocates for
// them. It need not understand JSON: in valid JSON it counts exactly, the rest the parser refuses.
[[nodiscard]] Result<Nothing> check_control_shape(std::string_view text);

}  // namespace connect_bridge
