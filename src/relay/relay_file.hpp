// The file that a relay is configured by.
#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"

namespace connect_bridge {

// A map of those parameters of a server that a relay has too, with the same meaning: `listen`
// (address, port, trusted_proxies, who speak the PROXY protocol), `tls` (certificate, private_key)
// and `auth` (token_file: the robots, each an `identity` with the hash of its token), `status`
// (listen, on the loopback) and `strict_modes`. `config` is present exactly if there are no
// problems.
struct RelayFile {
  std::optional<Config> config;
  std::vector<std::string> problems;  // sentences, for people
};

// `text`: YAML; any text.
[[nodiscard]] RelayFile read_relay_file(const std::string& text, const Surroundings& surroundings);

}  // namespace connect_bridge
