// What the peers' names are at this side: `prefix`, `remap` and `identity_names`.
#pragma once

#include <vector>

#include "config/checked_values.hpp"
#include "config/config.hpp"

namespace connect_bridge {

// Fills the names of `config`, whose role, login and prefix are known already.
void read_peer_names(const CheckedValues& values, Config& config, std::vector<Problem>& problems);

}  // namespace connect_bridge
