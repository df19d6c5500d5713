#include "access/login/credential.hpp"

#include <cstdlib>
#include <utility>

#include "access/login/secret.hpp"

namespace connect_bridge {
namespace {

void take(std::string_view token, const std::string& source, Credential& credential) {
  credential.source = source;
  const std::string_view word = trim(token);
  const std::string wrong = token_problem(word);
  if (!wrong.empty()) {
    credential.problems.push_back(source + ": " + wrong);
    return;
  }
  credential.bytes.assign(word.begin(), word.end());
}

}  // namespace

Credential client_credential(const CredentialOptions& options) {
  Credential credential;
  if (options.method == "none") return credential;
  if (!options.token.empty()) {
    take(options.token, "auth.token", credential);
    return credential;
  }
  if (!options.token_file.empty()) {
    Failure problem;
    auto text = read_login_file(options.token_file, options.strict_modes, problem);
    if (!text) {
      credential.problems.push_back("auth.token_file " + problem.text);
      credential.cause = problem.cause;
      return credential;
    }
    take(*text, "auth.token_file '" + options.token_file + "'", credential);
    wipe(*text);
    const std::string readers = who_else_may_read(options.token_file);
    if (!readers.empty()) credential.warnings.push_back("auth.token_file " + readers);
    return credential;
  }
  if (const char* const variable = std::getenv(kTokenVariable)) {
    take(variable, std::string{"environment variable "} + kTokenVariable, credential);
    return credential;
  }
  credential.problems.push_back(
      std::string{"no token: give auth.token_file, auth.token or the environment variable "} +
      kTokenVariable);
  return credential;
}

CredentialFile::CredentialFile(CredentialOptions options)
    : options_(std::move(options)), watch_(options_.token_file) {}

std::optional<Credential> CredentialFile::changed() {
  if (!watch_.settled_change()) return std::nullopt;
  Credential credential = client_credential(options_);
  if (!credential.problems.empty() && !watch_.failed(credential.problems.front()))
    return std::nullopt;
  return credential;
}

}  // namespace connect_bridge
