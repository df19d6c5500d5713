// The parameters of the login, and whether they fit together.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/checked_values.hpp"
#include "config/config.hpp"

namespace connect_bridge {

// What a library with a login method gets: the rows of the login that have no field.
[[nodiscard]] std::map<std::string, std::string> read_plugin_options(const CheckedValues& values);

// Adds contradictions between the keys of the login; role and login of `config` are set.
void check_login(const CheckedValues& values, const Config& config, const Surroundings& around,
                 std::vector<Problem>& problems);

// Fills config.status: beyond loopback it wants TLS, tokens and groups, or is served nowhere there.
void read_status(const CheckedValues& values, Config& config, std::vector<Problem>& problems);

// Adds a problem for each rule for identities or groups that no peer of this side can have;
// `config` has what is said of login, url and TLS.
void check_named(const CheckedValues& values, const Config& config, const std::vector<Rule>& rules,
                 std::vector<Problem>& problems);

}  // namespace connect_bridge
