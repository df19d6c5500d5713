// The rows of the key table about the shares of peers in this side's resources.
#pragma once

#include <vector>

#include "config/key_table.hpp"
#include "core/side/options.hpp"

namespace connect_bridge {

void add_share_rows(std::vector<KeySpec>& rows, const SideOptions& core);

}  // namespace connect_bridge
