// A configuration in words, for `ctl check`.
#pragma once

#include <string>

#include "config/config.hpp"

namespace connect_bridge {

// Explains in several lines: how this side listens or connects, who may log in, what each rule
// allows, and the warnings.
[[nodiscard]] std::string explain(const Config& config);

}  // namespace connect_bridge
