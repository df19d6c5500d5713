// The rows of the table of keys about limits: of a link, of all peers together, of strangers.
#pragma once

#include <vector>

#include "config/key_table.hpp"

namespace connect_bridge {

void add_limit_rows(std::vector<KeySpec>& rows);

}  // namespace connect_bridge
