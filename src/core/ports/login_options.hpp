// Options of the login methods: `config` reads them, `run` adds what is computed.
#pragma once

#include <map>
#include <string>

namespace connect_bridge {

struct LoginOptions {
  // The first three also hold for a client. "token", "jwt", "service", "plugin", "certificate" or
  // "none".
  std::string method = "token";
  std::string token;       // secret; server: the one token of everybody
  std::string token_file;  // server: YAML with several tokens, or one token
  std::string plugin;      // of the method "plugin": the shared library
  // Files that decide about access must be safe from other users (who_else_may_change()).
  bool strict_modes = true;
  // Options for a library with a login method: its own keys without "auth.". May hold secrets.
  std::map<std::string, std::string> plugin_options;

  // The option's value; empty: not given.
  [[nodiscard]] std::string option(const std::string& key) const {
    const auto found = plugin_options.find(key);
    return found == plugin_options.end() ? "" : found->second;
  }
};

}  // namespace connect_bridge
