#include "config/explain.hpp"

#include <fmt/format.h>

#include "config/key_search.hpp"
#include "config/rule_reader.hpp"
#include "config/syntax.hpp"

namespace connect_bridge {
namespace {

using Names = std::vector<std::string>;

Names texts(const std::vector<Pattern>& patterns) {
  Names names;
  for (const Pattern& pattern : patterns) names.push_back(pattern.text());
  return names;
}

// Makes "a, b or c".
std::string joined(const Names& names, std::string_view last) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? fmt::format(" {} ", last) : ", ";
    text += names[i];
  }
  return text;
}

std::string listen_text(const Config& config) {
  const ListenOptions& listen = config.listen;
  const bool passed = config.listen_address == "systemd";
  std::string where = config.listen_address == "*" ? "every address" : config.listen_address;
  if (passed) where = "the sockets of systemd";
  std::string port = listen.port == 0 ? "any free port" : fmt::format("port {}", listen.port);
  if (passed) port = "their ports";
  const std::string reach = syntax::listens_on_loopback(config.listen_address)
                                ? "reachable from this machine only"
                                : "reachable by others";
  std::string tls = "without TLS";
  if (!config.tls.certificate_file.empty()) {
    tls = fmt::format("with TLS (certificate {})", config.tls.certificate_file);
  }
  if (!config.tls.ca_file.empty())
    tls += fmt::format(", clients show one signed by {}", config.tls.ca_file);
  std::string proxies;
  if (!listen.trusted_proxies.empty()) {
    proxies =
        fmt::format("; {} gives the client's address by {}", joined(listen.trusted_proxies, "or"),
                    word_of(syntax::kNamedByWords, listen.named_by));
    if (listen.proxies_only) proxies += "; only these may connect";
  }
  return fmt::format("listens: on {}, {}, {}; {}{}", where, port, tls, reach, proxies);
}

std::string proxy_words(const std::optional<HttpProxy>& proxy) {
  if (!proxy) return {};
  return fmt::format("; through the HTTP proxy {}:{}{}", proxy->host, proxy->port,
                     proxy->login.empty() ? "" : ", with a login");
}

std::string dial_text(const Config& config) {
  const std::string url = syntax::url_to_show(string_at(config.given, "url"));
  if (!config.dial.url.secure)
    return fmt::format("connects to: {}, without TLS{}", url, proxy_words(config.dial.proxy));
  const Names& pins = config.tls.pins;
  std::string text = fmt::format("connects to: {}, with TLS; the ", url);
  if (!pins.empty())
    text += fmt::format("server's public key must have the pin {}", joined(pins, "or"));
  if (!pins.empty() && !config.tls.ca_file.empty()) text += ", and the ";
  if (pins.empty() || !config.tls.ca_file.empty())
    text += fmt::format(
        "certificate must be for {} and signed by {}", config.dial.url.host,
        config.tls.ca_file.empty() ? "an authority the system trusts" : config.tls.ca_file);
  if (!config.tls.certificate_file.empty()) text += "; shows " + config.tls.certificate_file;
  return text + proxy_words(config.dial.proxy);
}

std::string login_text(const Config& config) {
  if (config.auth.method == "none") return "login: none";
  if (config.auth.method == "certificate") {
    return config.role == Role::kClient
               ? "login: by certificate"
               : "login: by the client's certificate, which names the identity (common name) and "
                 "its groups (organizations)";
  }
  if (config.role == Role::kServer && config.auth.method == "jwt") {
    return fmt::format("login: JWT of {} for {}, signed by a key in {}",
                       config.auth.option("jwt_issuer"), config.auth.option("jwt_audience"),
                       syntax::url_to_show(config.auth.option("jwt_keys")));
  }
  if (config.role == Role::kServer && config.auth.method == "service")
    return "login: as the service " + syntax::url_to_show(config.auth.option("service")) + " says";
  if (config.role == Role::kServer && config.auth.method == "plugin")
    return "login: as the plugin " + config.auth.plugin + " decides";
  std::string source = "the environment variable CONNECT_BRIDGE_TOKEN";
  if (!config.auth.token_file.empty()) source = config.auth.token_file;
  if (!config.auth.token.empty()) source = "the parameter auth.token";
  return fmt::format("login: {}, taken from {}", config.auth.method, source);
}

std::string who_text(const Rule& rule) {
  Names who = rule.identities;
  if (!rule.groups.empty()) who.push_back("a member of " + joined(rule.groups, "or"));
  return who.empty() ? "" : ", if logged in as " + joined(who, "or");
}

// "all topics", or the patterns behind `before`.
std::string names_text(const Names& patterns, std::string_view before, std::string_view all) {
  if (patterns == Names{"/**"}) return fmt::format("all {}", all);
  if (patterns == texts(default_rule().opens[Direction::kImport][OpenedBy::kTopics]))
    return fmt::format("all {}, hidden ones too", all);
  return fmt::format("{}{}", before, joined(patterns, "and"));
}

void add_rights(const Rule& rule, Names& parts) {
  const std::string types =
      rule.types.empty() ? "" : fmt::format(" ({} only)", joined(rule.types, "or"));
  const std::string who = who_text(rule);
  const auto add = [&](Direction direction, OpenedBy kind, std::string_view may,
                       std::string_view before, std::string_view all) {
    const std::vector<Pattern>& patterns = rule.opens[direction][kind];
    if (patterns.empty()) return;
    parts.push_back(fmt::format("the peer may {} {}{}{}", may,
                                names_text(texts(patterns), before, all),
                                kind == OpenedBy::kParameters ? "" : types, who));
  };
  add(Direction::kImport, OpenedBy::kTopics, "publish to", "", "topics");
  add(Direction::kExport, OpenedBy::kTopics, "receive", "", "topics");
  add(Direction::kExport, OpenedBy::kServices, "call", "", "services");
  add(Direction::kImport, OpenedBy::kServices, "offer", "the services ", "services");
  add(Direction::kExport, OpenedBy::kActions, "use", "the actions ", "actions");
  add(Direction::kImport, OpenedBy::kActions, "offer", "the actions ", "actions");
  add(Direction::kExport, OpenedBy::kParameters, "read and set parameters of", "the nodes ",
      "nodes");
  add(Direction::kImport, OpenedBy::kParameters, "offer parameters of", "the nodes ", "nodes");
  if (!rule.deny.empty()) {
    parts.push_back(
        fmt::format("never {}{}, whatever rules allow", joined(texts(rule.deny), "or"), who));
  }
}

// Adds the keys of the treatment that differ from their defaults, as given.
void add_treatment(const ParameterMap& given, const Rule& rule, Names& parts) {
  for (const KeySpec& spec : key_table()) {
    if (rule_of(spec.key).empty() || spec.section == kRuleRights) continue;
    const auto found = given.find(key_of(spec, rule.name));
    if (found == given.end() || found->second == spec.fallback) continue;
    const auto* word = std::get_if<std::string>(&found->second);
    parts.push_back(fmt::format("{} {}{}{}", spec.key.substr(spec.key.rfind('>') + 2),
                                word ? *word : to_text(found->second), spec.unit.empty() ? "" : " ",
                                spec.unit));
  }
}

std::string rule_text(const ParameterMap& given, const Rule& rule) {
  Names parts;
  add_rights(rule, parts);
  add_treatment(given, rule, parts);
  return fmt::format("  {}: {}\n", rule.name, fmt::join(parts, "; "));
}

}  // namespace

std::string explain(const Config& config) {
  const bool server = config.role == Role::kServer;
  std::string text = (server ? listen_text(config) : dial_text(config)) + "\n";
  text += login_text(config) + "\n";
  if (config.robot == Role::kClient)
    text += fmt::format("robot: {}\n", server ? "the client" : "this end");
  if (config.prefix == syntax::kByIdentity) {
    text +=
        "names: the peer's /x is /IDENTITY/x at this side; only what is below that can be "
        "exported to it\n";
    for (const auto& [identity, word] : config.identity_names)
      text += fmt::format("names: the identity {} is /{}\n", identity, word);
  } else if (!config.prefix.empty()) {
    text += fmt::format(
        "names: the peer's /x is {0}/x at this side; only what is below {0} can be exported\n",
        config.prefix);
  }
  for (const NameMap::Pair& pair : config.remap) {
    text += fmt::format("names: the peer's {} is {} at this side\n", pair.wire, pair.local);
  }
  if (config.limits.proxy_nodes) {
    text += "graph: what is imported belongs to nodes named as the peer's\n";
  }
  if (config.clock_publish_period > Duration::zero()) {
    text += fmt::format(
        "clock: the peer's ROS time is published on /clock every {} ms, in place of its /clock\n",
        config.clock_publish_period / std::chrono::milliseconds(1));
  }
  text += config.default_rules
              ? "rules: none given, so all that the peer allows, but from here topics only\n"
              : "rules, the first that allows an interface decides:\n";
  for (const Rule& rule : config.policy.rules()) {
    // Rules with a dot were not written by the operator: the line "clock:" describes them.
    if (rule.name.find('.') == std::string::npos) text += rule_text(config.given, rule);
  }
  if (config.policy.rules().empty()) text += "  none: nothing is allowed\n";
  for (const std::string& warning : config.warnings) text += "warning: " + warning + "\n";
  return text;
}

}  // namespace connect_bridge
