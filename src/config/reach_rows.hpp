// The rows of the key table that are about who is reached where.
#pragma once

#include <vector>

#include "config/key_table.hpp"

namespace connect_bridge {

void add_reach_rows(std::vector<KeySpec>& rows);

}  // namespace connect_bridge
