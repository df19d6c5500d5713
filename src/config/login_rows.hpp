// The rows of the key table that are about the login.
#pragma once

#include <vector>

#include "config/key_table.hpp"

namespace connect_bridge {

void add_login_rows(std::vector<KeySpec>& rows);

}  // namespace connect_bridge
