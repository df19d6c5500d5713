// Adds the rows of the keys of a rule.
#pragma once

#include <string>
#include <vector>

#include "config/key_table.hpp"
#include "core/policy/policy.hpp"

namespace connect_bridge {

void add_rule_rows(std::vector<KeySpec>& rows);

// The last part of the key that opens names of this kind: "export_topics". Not for kNothing.
[[nodiscard]] std::string right_key(Direction direction, OpenedBy kind);

}  // namespace connect_bridge
