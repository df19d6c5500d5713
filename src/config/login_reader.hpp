// The parameters of the login, and whether they fit together.
#pragma once

#include <vector>

#include "config/checked_values.hpp"
#include "config/config.hpp"

namespace connect_bridge {

// The proxy on the way to the address that this login method asks. Adds what is wrong with the
// environment's.
[[nodiscard]] std::optional<HttpProxy> read_https_proxy(const LoginOptions& auth,
                                                        const Surroundings& around,
                                                        std::vector<Problem>& problems);
// Adds contradictions between the keys of the login; role and login of `config` are set.
void check_login(const CheckedValues& values, const Config& config, const Surroundings& around,
                 std::vector<Problem>& problems);

}  // namespace connect_bridge
