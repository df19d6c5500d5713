// The part of the table that describes the keys of a rule.
#pragma once

#include <vector>

#include "config/key_table.hpp"

namespace connect_bridge {

void add_rule_rows(std::vector<KeySpec>& rows);

}  // namespace connect_bridge
