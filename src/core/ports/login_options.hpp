// Options of the login methods: `config` reads them, `run` adds what is computed.
#pragma once

#include <map>
#include <string>

namespace connect_bridge {

struct LoginOptions {
  // A client's are the first three. "token", "jwt", "service", "plugin", "certificate" or "none".
  std::string method = "token";
  std::string token;       // secret; of a server the one token for everybody who has it
  std::string token_file;  // of a server YAML with several, or one token
  std::string plugin;      // of the method "plugin": the shared library
  // Files that decide who gets in must be safe from other users (who_else_may_change()).
  bool strict_modes = true;
  // What a library with a login method gets: its own keys without "auth.". May hold secrets.
  std::map<std::string, std::string> plugin_options;

  // Empty: not given.
  [[nodiscard]] std::string option(const std::string& key) const {
    const auto found = plugin_options.find(key);
    return found == plugin_options.end() ? "" : found->second;
  }
};

}  // namespace connect_bridge
