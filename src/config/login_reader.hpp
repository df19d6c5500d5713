// Reads the parameters of the login and of the status, and checks that they fit together.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/checked_values.hpp"
#include "config/config.hpp"

namespace connect_bridge {

// Options for the library of a login method: the rows of the login that have no field.
[[nodiscard]] std::map<std::string, std::string> read_plugin_options(const CheckedValues& values);

// Adds contradictions between the keys of the login; role and login of `config` are set.
void check_login(const CheckedValues& values, const Config& config, const Surroundings& around,
                 std::vector<Problem>& problems);

// Fills config.status. An address beyond loopback requires TLS, tokens and groups; adds a problem
// for each that is missing.
void read_status(const CheckedValues& values, Config& config, std::vector<Problem>& problems);

// Adds a problem for each rule whose identities or groups no peer of this side can have. `config`
// must have its login, url and TLS.
void check_named(const CheckedValues& values, const Config& config, const std::vector<Rule>& rules,
                 std::vector<Problem>& problems);

}  // namespace connect_bridge
