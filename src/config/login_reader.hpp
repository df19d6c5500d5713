// The parameters of the login, and whether they fit together.
#pragma once

#include <vector>

#include "config/checked_values.hpp"
#include "config/config.hpp"

namespace connect_bridge {

// Adds what is wrong with the proxy of the environment, where the login method needs one.
[[nodiscard]] AuthConfig read_auth(const CheckedValues& values, const Surroundings& around,
                                   std::vector<Problem>& problems);
// Adds what is wrong between the keys of the login; role and login of `config` are set.
void check_login(const CheckedValues& values, const Config& config, const Surroundings& around,
                 std::vector<Problem>& problems);

}  // namespace connect_bridge
