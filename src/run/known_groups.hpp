// The groups that a server's own file gives an identity, for `ctl explain`.
#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"

namespace connect_bridge {

struct KnownGroups {
  std::vector<std::string> groups;
  std::string text;  // a line for people: where they come from, or that none are known
};

// The groups of an identity, as far as the configuration names them: at a server those of all its
// tokens in auth.token_file, at a client those behind its key in tls.pin. Other login methods name
// groups only at a login.
[[nodiscard]] KnownGroups known_groups(const Config& config, const std::string& identity);

}  // namespace connect_bridge
