// The rows of the key table that are about those who have not logged in.
#pragma once

#include <vector>

#include "config/key_table.hpp"
#include "core/side/options.hpp"

namespace connect_bridge {

void add_stranger_rows(std::vector<KeySpec>& rows, const SideOptions& core);

}  // namespace connect_bridge
