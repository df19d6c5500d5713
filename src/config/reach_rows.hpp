// The rows of the key table about addresses, URLs and proxies.
#pragma once

#include <vector>

#include "config/key_table.hpp"

namespace connect_bridge {

void add_reach_rows(std::vector<KeySpec>& rows);

}  // namespace connect_bridge
