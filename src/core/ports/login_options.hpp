// Options of the login methods: `config` reads them, `run` adds what is computed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/ports/url.hpp"

namespace connect_bridge {

struct JwtOptions {
  std::string keys_file;                // JWKS or PEM; or
  std::optional<Url> keys_address;      // a JWKS
  std::string issuer;                   // "iss" must be this one
  std::string audience;                 // "aud" must be this one or name it
  std::vector<std::string> algorithms;  // the accepted ones; never "none"
  std::string groups_claim = "groups";  // a list of names, or one
};

struct LoginOptions {
  // A client's are the first three. "token", "jwt", "service", "plugin", "certificate" or "none".
  std::string method = "token";
  std::string token;       // secret; of a server the one token for everybody who has it
  std::string token_file;  // of a server YAML with several, or one token
  JwtOptions jwt;
  Url service;                 // of the method "service"
  std::string plugin;          // the shared library
  std::string plugin_options;  // may hold a secret
};

}  // namespace connect_bridge
