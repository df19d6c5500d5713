// The credential that a client logs in with.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "access/login/file_watch.hpp"
#include "core/base/bytes.hpp"
#include "core/ports/failure.hpp"

namespace connect_bridge {

inline constexpr char kTokenVariable[] = "CONNECT_BRIDGE_TOKEN";

struct CredentialOptions {
  std::string method = "token";  // "none"; every other method sends a token
  std::string token;
  std::string token_file;
  bool strict_modes = true;  // as in LoginOptions
};

// The credential and its source. It is valid only if there are no problems.
struct Credential {
  Bytes bytes;
  std::string source;  // "parameter auth.token", "file ...", "environment variable ..."
  std::vector<std::string> problems;
  std::vector<std::string> warnings;
  Cause cause = Cause::kTokenMissing;  // of the problems
};

// The token from the first of: parameter, file, environment variable CONNECT_BRIDGE_TOKEN. The
// program has to clear the environment and the command line afterwards.
[[nodiscard]] Credential client_credential(const CredentialOptions& options);

// Watches a client's token file while the client runs. One thread.
class CredentialFile {
 public:
  // Create this object before the file is read for the first time.
  explicit CredentialFile(CredentialOptions options);

  // The credential, if the file has changed and its writer is done; called once a second. If it has
  // problems, the former credential stays valid.
  [[nodiscard]] std::optional<Credential> changed();

 private:
  CredentialOptions options_;
  FileWatch watch_;
};

}  // namespace connect_bridge
