#include "config/login_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "config/syntax.hpp"
#include "core/ports/pin.hpp"

namespace connect_bridge {
namespace {

using Problems = std::vector<Problem>;

bool is_server(const Config& config) {
  return config.role == Role::kServer;
}

void add(Problems& problems, std::string_view key, std::string value, std::string expected) {
  problems.push_back({std::string{key}, std::move(value), std::move(expected)});
}

// A login by certificate needs a certificate at the client and, at the server, an authority in
// tls.ca.
void check_certificate_login(const CheckedValues& values, const Config& config,
                             Problems& problems) {
  const char* const key = is_server(config) ? "tls.ca" : "tls.certificate";
  if (values.given(key)) return;
  add(problems, key, "",
      is_server(config) ? "the authority that signs the clients' certificates, with auth.method: "
                          "certificate"
                        : "the certificate to log in with, with auth.method: certificate");
}

void check_token(const CheckedValues& values, const Config& config, const Surroundings& around,
                 Problems& problems) {
  const bool token = values.given("auth.token");
  const bool file = values.given("auth.token_file");
  if (token && file) add(problems, "auth.token_file", "", "either auth.token or auth.token_file");
  const std::string& method = config.auth.method;
  if (method == "certificate") check_certificate_login(values, config, problems);
  const bool shows_token = method != "none" && method != "certificate" && !is_server(config);
  if (method != "token" && !shows_token) {
    for (const char* key : {"auth.token", "auth.token_file"}) {
      if (values.given(key))
        add(problems, key, "", "auth.method: token too, else it has no effect");
    }
  } else if (!token && !file && !around.token_in_environment) {
    add(problems, "auth.token_file", "",
        fmt::format("a token: auth.token_file, auth.token or the environment variable "
                    "CONNECT_BRIDGE_TOKEN{}",
                    is_server(config) ? " (or auth.method: none, on loopback only)" : ""));
  }
}

// Keys of one login method of a server: some are required with it, all are without effect
// elsewhere.
void check_method(const CheckedValues& values, const Config& config, Problems& problems) {
  struct Part {
    const char* method;
    const char* key;
    bool needed;
  };
  for (const auto& [method, key, needed] :
       {Part{"jwt", "auth.jwt_keys", true}, Part{"jwt", "auth.jwt_issuer", true},
        Part{"jwt", "auth.jwt_audience", true}, Part{"service", "auth.service", true},
        Part{"plugin", "auth.plugin", true}, Part{"plugin", "auth.plugin_options", false}}) {
    const bool in_use = is_server(config) && values.text("auth.method") == method;
    if (in_use && needed && !values.given(key))
      add(problems, key, "", fmt::format("a value: auth.method: {} needs it", method));
    if (is_server(config) && !in_use && values.given(key))
      add(problems, key, "", fmt::format("auth.method: {} too, else it has no effect", method));
  }
}

// The setting without which rules can name no peer; empty: none is missing.
std::string why_nobody(const CheckedValues& values, const Config& config) {
  if (is_server(config)) return config.auth.method == "none" ? "a login (auth.method)" : "";
  if (!values.valid("url")) return {};
  if (!config.dial.url.secure) return "a url that begins with wss://";
  const auto& pins = config.tls.pins;
  const bool by_key = !pins.empty() && config.tls.ca_file.empty();
  const auto named = [](const std::string& entry) { return !pin_in(entry).is.name.empty(); };
  return by_key && std::none_of(pins.begin(), pins.end(), named)
             ? "the server's name behind its key in tls.pin"
             : "";
}

}  // namespace

void check_named(const CheckedValues& values, const Config& config, const std::vector<Rule>& rules,
                 std::vector<Problem>& problems) {
  const std::string nobody = why_nobody(values, config);
  if (nobody.empty()) return;
  for (const Rule& rule : rules)
    for (const auto& [key, names] :
         {std::pair{"identities", &rule.identities}, std::pair{"groups", &rule.groups}})
      if (!names->empty())
        add(problems, fmt::format("rule.{}.{}", rule.name, key), to_text(*names),
            nobody + ", else the rule applies to nobody");
}

std::map<std::string, std::string> read_plugin_options(const CheckedValues& values) {
  constexpr std::string_view kLogin = "auth.";
  std::map<std::string, std::string> options;
  if (!values.flag("strict_modes")) options.emplace("strict_modes", "false");
  for (const KeySpec& spec : key_table()) {
    if (!spec.key.starts_with(kLogin) || spec.store.index() != 0) continue;
    std::string value = spec.type == ParameterType::kStrings
                            ? fmt::format("{}", fmt::join(values.list(spec.key), " "))
                            : values.text(spec.key);
    if (!value.empty()) options.emplace(spec.key.substr(kLogin.size()), std::move(value));
  }
  return options;
}

void check_login(const CheckedValues& values, const Config& config, const Surroundings& around,
                 std::vector<Problem>& problems) {
  check_token(values, config, around, problems);
  check_method(values, config, problems);
}

// Whether clients come to the address of the status.
bool is_listened_to(const StatusOptions& status, const Config& config) {
  if (config.role != Role::kServer || config.listen_address == "systemd") return false;
  const auto is_same = [&](const std::string& address) {
    return address == status.address || address == "*" || address == "0.0.0.0";
  };
  const auto& addresses = config.listen.addresses;
  return status.port != 0 && status.port == config.listen.port &&
         std::any_of(addresses.begin(), addresses.end(), is_same);
}

void read_status(const CheckedValues& values, Config& config, std::vector<Problem>& problems) {
  constexpr const char* kListen = "status.listen";
  StatusOptions& status = config.status;
  if (const auto at = syntax::parse_status_address(values.text(kListen)))
    status = {at->host, at->port, status.groups, !syntax::is_loopback(at->host)};
  if (is_listened_to(status, config))
    return add(problems, kListen, to_text(values.text(kListen)),
               "another port than listen.port, where clients come");
  if (!status.beyond_loopback) {  // mutant: status_beyond_loopback
    if (!status.groups.empty())
      add(problems, "status.groups", to_text(status.groups),
          "status.listen beyond loopback too: on loopback nobody is asked who he is");
    return;
  }
  const std::string local =
      fmt::format("127.0.0.1:{0}, and from elsewhere ssh -L {0}:127.0.0.1:{0}", status.port);
  const std::string shown = to_text(values.text(kListen));
  if (config.role == Role::kClient) return add(problems, kListen, shown, "at a client " + local);
  config.reached_by_others = true;
  const std::string or_local = "; or " + local;
  if (config.tls.certificate_file.empty())
    add(problems, kListen, shown,
        "tls.certificate and tls.private_key too beyond loopback" + or_local);
  if (config.auth.method != "token" || config.auth.token_file.empty())
    add(problems, kListen, shown,
        "auth.token_file too beyond loopback: who looks shows a token" + or_local);
  if (status.groups.empty())
    add(problems, "status.groups", "",
        "the groups that may look, since status.listen is beyond loopback");
}

}  // namespace connect_bridge
