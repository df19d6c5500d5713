#include "config/login_rows.hpp"

#include <string>
#include <utility>

#include "config/syntax.hpp"

namespace connect_bridge {
namespace {

using namespace syntax;  // NOLINT: a table reads better without the repeated word
using Strings = std::vector<std::string>;
using Rows = std::vector<KeySpec>;

constexpr char kLoginSection[] = "Login";

void add_jwt(Rows& rows) {
  const auto add_row = section_adder(rows, kLoginSection);
  const auto add = [&](KeySpec spec) {
    spec.used_by = UsedBy::kServer;
    add_row(std::move(spec));
  };
  add({.key = "auth.jwt_keys",
       .syntax = check_file_or_http_url,
       .help = "`jwt`: the keys that sign tokens: a file, JWKS or public keys in PEM, or the "
               "https:// address of a JWKS. Followed while the program runs."});
  add({.key = "auth.jwt_issuer", .syntax = check_not_empty, .help = "What `iss` must be."});
  add({.key = "auth.jwt_audience",
       .syntax = check_not_empty,
       .help = "What `aud` must be, or contain."});
  add({.key = "auth.jwt_algorithms",
       .fallback = Strings{"RS256", "ES256", "EdDSA"},
       .words = {"RS256", "ES256", "EdDSA", "HS256"},
       .help = "Algorithms that are taken. HS256 must be asked for: who can check such a token can "
               "make one."});
  add({.key = "auth.jwt_groups_claim",
       .fallback = "groups",
       .syntax = check_not_empty,
       .help = "The claim that names the groups."});
}

}  // namespace

void add_login_rows(Rows& rows) {
  const auto add = section_adder(rows, kLoginSection);
  add({.key = "auth.method",
       .fallback = "token",
       .words = {"token", "jwt", "service", "plugin", "certificate", "none"},
       .help = "How a client proves who it is; the same at both sides. `certificate`: "
               "by the one it shows (tls.ca at the server). `none` is refused by a "
               "server that listens beyond loopback."});
  add({.key = "auth.token",
       .syntax = check_token,
       .secret = true,
       .help = "The token itself. A file or the environment variable "
               "`CONNECT_BRIDGE_TOKEN` keeps it out of parameter files."});
  add({.key = "auth.token_file",
       .syntax = check_not_empty,
       .help = "File with the token (client), or with the token or the hashes of many and "
               "their identities (server). Followed while the program runs."});
  add_jwt(rows);
  add({.key = "auth.service",
       .syntax = check_http_url,
       .used_by = UsedBy::kServer,
       .help = "`service`: the https:// address that is asked about each login."});
  add({.key = "auth.https_ca",
       .syntax = check_not_empty,
       .used_by = UsedBy::kServer,
       .help = "File with the authorities (PEM) that `auth.jwt_keys` and `auth.service` "
               "are trusted by; without it those of the system."});
  add({.key = "auth.plugin",
       .syntax = check_not_empty,
       .used_by = UsedBy::kServer,
       .help = "`plugin`: the shared library that decides, made with "
               "connect_bridge/auth_plugin.h. It runs inside the server."});
  add({.key = "auth.plugin_options",
       .used_by = UsedBy::kServer,
       .secret = true,
       .help = "What the library gets at its start."});
}

}  // namespace connect_bridge
