// What a client logs in with.
#pragma once

#include <string>
#include <vector>

#include "core/base/bytes.hpp"

namespace connect_bridge {

inline constexpr char kTokenVariable[] = "CONNECT_BRIDGE_TOKEN";

struct CredentialOptions {
  std::string method = "token";  // "token" or "none"
  std::string token;
  std::string token_file;
};

struct Credential {
  Bytes bytes;
  std::string source;  // "parameter auth.token", "file ...", "environment variable ..."
  std::vector<std::string> problems;
  std::vector<std::string> warnings;
};

// The first of: parameter, file, environment variable CONNECT_BRIDGE_TOKEN. To scrub the
// environment and the command line afterwards is the program's task.
[[nodiscard]] Credential client_credential(const CredentialOptions& options);

}  // namespace connect_bridge
