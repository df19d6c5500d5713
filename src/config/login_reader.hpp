// The parameters of the login, and whether they fit together.
#pragma once

#include <vector>

#include "config/checked_values.hpp"
#include "config/config.hpp"

namespace connect_bridge {

// Adds what is wrong with the environment's proxy, if the login method needs one.
[[nodiscard]] AuthConfig read_auth(const CheckedValues& values, const Surroundings& around,
                                   std::vector<Problem>& problems);
// Adds contradictions between the keys of the login; role and login of `config` are set.
void check_login(const CheckedValues& values, const Config& config, const Surroundings& around,
                 std::vector<Problem>& problems);

}  // namespace connect_bridge
