// What this machine says when a configuration is checked: environment, files, installed types.
#pragma once

#include "config/config.hpp"

namespace connect_bridge {

// The variables of this process.
[[nodiscard]] Variable environment();

// The information about this machine that a configuration is checked against. It reads files when
// it is asked, and makes none. Thread: any, one at a time.
[[nodiscard]] Surroundings surroundings();

}  // namespace connect_bridge
