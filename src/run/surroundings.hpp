// Facts of this machine for the check of a configuration: environment, files, installed types.
#pragma once

#include "config/config.hpp"

namespace connect_bridge {

// The variables of this process.
[[nodiscard]] Variable environment();

// The facts that a configuration is checked against. Reads files at each call, and creates none.
// Thread: any, one at a time.
[[nodiscard]] Surroundings surroundings();

}  // namespace connect_bridge
