// The rows of the table about the audit log.
#pragma once

#include <vector>

#include "config/key_table.hpp"

namespace connect_bridge {

void add_audit_rows(std::vector<KeySpec>& rows);

}  // namespace connect_bridge
