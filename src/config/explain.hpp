// A configuration in words, for `ctl check`.
#pragma once

#include <string>

#include "config/config.hpp"

namespace connect_bridge {

// Several lines: how this side listens or dials, who may log in, what each rule allows, and the
// warnings.
[[nodiscard]] std::string explain(const Config& config);

}  // namespace connect_bridge
