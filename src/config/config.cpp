#include "config/config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "config/checked_values.hpp"
#include "config/http_proxy.hpp"
#include "config/key_search.hpp"
#include "config/login_reader.hpp"
#include "config/rule_reader.hpp"
#include "config/syntax.hpp"

namespace connect_bridge {
namespace {

constexpr char kNotStrict[] = "strict_modes: false";
// The largest message is with its sender's link, with a worker and with the middleware.
constexpr std::uint64_t kMessagesInMemory = 3;
constexpr std::uint64_t kMemoryMin = 64ULL << 20;  // unless the operator says less

// Makes a Config, check by check; every check adds its problems and goes on.
class ConfigMaker {
 public:
  ConfigMaker(const ParameterMap& given, Role role, const Surroundings& around)
      : values_(given, role, parsed_.problems), around_(around) {
    config_.role = role;
    config_.token_in_environment = around.token_in_environment;
  }

  Parsed make(ReadAt moment) {
    values_.store(config_);
    if (is_server()) config_.auth.plugin_options = read_plugin_options(values_);
    check_tls();
    if (is_server()) {
      check_listen();
    } else {
      read_dial();
    }
    read_status(values_, config_, parsed_.problems);
    check_login(values_, config_, around_, parsed_.problems);
    check_files();
    if (config_.audit.required && config_.audit.file.empty())
      add("audit.required", "true", "audit.file too, else no call can be recorded");
    read_names();
    derive_limits();
    // Messages sent before a break must not move the robot after it.
    config_.limits.resumes_exported = config_.is_robot();
    config_.limits.resumes_imported = !config_.is_robot();
    config_.limits.robot = config_.is_robot() ? "sender" : "receiver";
    config_.limits.at_robot = config_.is_robot();
    // A single link can use a third of the memory (core/base/budget.hpp).
    const SideOptions& limits = config_.limits;
    if (limits.account.memory_bytes_max / kMessagesInMemory < limits.reassembly.message_bytes_max)
      warn(
          "memory_max: less than 3 times max_message_size, so there is no room for the largest "
          "messages");
    read_policy(moment);
    if (parsed_.problems.empty()) {
      config_.given = values_.values();
      parsed_.config = std::move(config_);
    }
    return std::move(parsed_);
  }

 private:
  [[nodiscard]] bool is_server() const { return config_.role == Role::kServer; }
  void add(std::string_view key, std::string value, std::string expected,
           Cause cause = Cause::kNone) {
    parsed_.problems.emplace_back(std::string{key}, std::move(value), std::move(expected), cause);
  }
  void warn(std::string text) { config_.warnings.push_back(std::move(text)); }

  void check_tls() {
    const bool certificate = values_.given("tls.certificate");
    const bool key = values_.given("tls.private_key");
    if (certificate && !key) add("tls.private_key", "", "the key of tls.certificate");
    if (key && !certificate) add("tls.certificate", "", "the certificate of tls.private_key");
    if (is_server() && values_.given("tls.ca") && !certificate && !key) {
      add("tls.ca", "",
          "tls.certificate and tls.private_key too: without TLS no client "
          "shows a certificate");
    }
  }

  void check_listen() {
    if (config_.listen.named_by != NamedBy::kXForwardedFor &&
        config_.listen.trusted_proxies.empty())
      add("listen.proxy_header", "", "listen.trusted_proxies too, else it has no effect");
    read_relay();
    const std::string& address = config_.listen_address;
    config_.listen.addresses = syntax::listen_addresses(address);
    const bool beyond = !syntax::listens_on_loopback(address);
    config_.reached_by_others =
        beyond || !config_.listen.trusted_proxies.empty();  // mutant: login_behind_proxies
    const bool by_relay = config_.listen.relay.has_value();
    if (by_relay) config_.reached_by_others = true;  // mutant: login_behind_a_relay
    if (!config_.reached_by_others) return;
    if (config_.auth.method == "none") {  // mutant: login_needed
      add("auth.method", "\"none\"",
          beyond ? fmt::format("a login (token), since listen.address {} is reachable by others",
                               address)
          : by_relay ? "a login (token), since others connect through the relay"
                     : "a login (token), since others connect through the proxies of "
                       "listen.trusted_proxies");
    }
    if (beyond && !values_.given("tls.certificate") && !values_.given("tls.private_key")) {
      judge_plain_listener(address);
    }
  }

  void read_relay() {
    constexpr const char* kUrl = "listen.relay.url";
    if (!values_.given(kUrl)) {
      for (const char* key : {"listen.relay.token_file", "listen.relay.ca"})
        if (values_.given(key)) add(key, "", "listen.relay.url too, else it has no effect");
      if (!config_.relay_pins.empty())
        add("listen.relay.pin", "", "listen.relay.url too, else it has no effect");
      return;
    }
    if (!values_.given("listen.relay.token_file"))
      add("listen.relay.token_file", "", "the file with this robot's token at the relay");
    if (!values_.given("tls.certificate") && !values_.given("tls.private_key"))
      add(kUrl, "",
          "tls.certificate and tls.private_key too: clients verify this server through the relay");
    const auto url = syntax::parse_url(values_.text(kUrl));
    if (!url) return;
    config_.listen.relay = RelayOptions{*url, {}, {}};
    config_.listen.relay->tls.ca_file = values_.text("listen.relay.ca");
    config_.listen.relay->tls.pins = config_.relay_pins;
    config_.relay_token_file = values_.text("listen.relay.token_file");
  }

  // The owner of the relay's domain can get a public certificate for any name in it.
  void check_dial_by_relay(const Url& url) {
    if (!url.secure) return add("url", "", "wss://, since it leads through a relay");
    if (!values_.given("tls.pin") && !values_.given("tls.ca"))  // mutant: blind_relay
      add("tls.pin", "",
          fmt::format(
              "tls.pin, or tls.ca with an authority of your own and a certificate for '{}': "
              "through a relay a certificate of a public authority proves nothing",
              url.robot));
  }

  void read_dial() {
    if (!values_.given("url")) {
      add("url", "", "the server to connect to, e.g. wss://robot.example/");
    }
    const auto url = syntax::parse_url(values_.text("url"));
    if (!url) return;
    config_.dial.url = *url;
    config_.reached_by_others = !syntax::is_loopback(url->host);
    config_.dial.proxy = read_http_proxy(values_, *url, around_.variable, parsed_.problems);
    if (!url->robot.empty()) check_dial_by_relay(*url);
    if (url->secure) return;
    for (const char* key : {"tls.ca", "tls.certificate", "tls.pin"}) {
      if (values_.given(key)) add(key, "", "a url that begins with wss://, else it has no effect");
    }
    if (config_.reached_by_others) {  // mutant: plaintext_dialed
      judge_plaintext("url", syntax::url_to_show(values_.text("url")),
                      "wss://, since the server is on another machine; or allow_plaintext: true");
    }
  }

  void judge_plain_listener(const std::string& address) {
    config_.listen.proxies_only =
        !config_.listen.trusted_proxies.empty() && !values_.flag("allow_plaintext");
    if (!config_.listen.proxies_only)
      return judge_plaintext("listen.address", address,
                             "tls.certificate and tls.private_key, since others can reach this "
                             "address; listen.trusted_proxies, if proxies do TLS for it; or "
                             "allow_plaintext: true");
    warn(
        fmt::format("listen.trusted_proxies: {} is used without TLS, by these proxies only; "
                    "everybody between them and this machine can read and change everything",
                    address));
  }

  void judge_plaintext(std::string_view key, const std::string& value, std::string expected) {
    if (!values_.flag("allow_plaintext")) {  // mutant: plaintext_reached
      add(key, to_text(value), std::move(expected));
    } else {
      warn(
          fmt::format("allow_plaintext: {} is used without TLS; everybody on the way can read and "
                      "change everything, the token included",
                      value));
    }
  }

  // Another user who may change such a file would decide who gets in.
  void check_file(const char* key, const std::string& file) {
    const std::string shown = to_text(value_to_show(*find_key(key), file));
    if (const Failure why = around_.unreadable ? around_.unreadable(file) : Failure{})
      return add(key, shown, "a file that this program can read: " + why.text, why.cause);
    if (!config_.auth.strict_modes || !around_.distrusted) return;
    if (const std::string why = around_.distrusted(file); !why.empty())
      add(key, shown, fmt::format("a file that nobody else may change: {}; or {}", why, kNotStrict),
          Cause::kFileDistrusted);
  }

  void check_files() {
    for (const char* key :
         {"auth.token_file", "auth.jwt_keys", "auth.https_ca", "auth.plugin", "tls.certificate",
          "tls.private_key", "tls.ca", "listen.relay.token_file", "listen.relay.ca"}) {
      if (!values_.valid(key) || syntax::parse_http_url(values_.text(key))) continue;
      check_file(key, values_.text(key));
    }
  }

  // Limits that are computed from stored limits.
  void derive_limits() {
    SideOptions& limits = config_.limits;
    limits.account.offence_period =
        Duration(std::chrono::minutes(1)) / values_.whole("limits.offences_per_minute");
    // The nodes of a small robot need most of its memory.
    if (!values_.given("memory_max") && around_.memory_bytes > 0)
      limits.account.memory_bytes_max = std::clamp<std::uint64_t>(
          around_.memory_bytes / 4, kMemoryMin, limits.account.memory_bytes_max);
    // A default does not contradict the other one.
    if (!values_.given("memory_max") && !values_.given("max_message_size"))
      limits.reassembly.message_bytes_max = std::min<std::uint64_t>(
          limits.reassembly.message_bytes_max, limits.account.memory_bytes_max / kMessagesInMemory);
    limits.mirror_bytes_max = limits.account.memory_bytes_max / 2;
    // Allows as many unfinished large messages at a time as the core's defaults, and no fewer if
    // messages are small: a peer sends parts of all topics in turn.
    const ReassemblyOptions normal;
    limits.reassembly.open_bytes_max =
        std::max(normal.open_bytes_max, limits.reassembly.message_bytes_max *
                                            (normal.open_bytes_max / normal.message_bytes_max));
  }

  void read_names() {
    const std::string graph = values_.text("graph");
    config_.limits.proxy_nodes = graph.empty() ? !config_.is_robot() : graph == "nodes";
    config_.carries_types_not_installed = values_.text("types_not_installed") == "carry";
    read_peer_names();
  }

  // Reads how the peers' names map to names at this side.
  void read_peer_names() {
    std::set<std::string> wires;
    std::set<std::string> locals;
    for (const std::string& text : values_.list("remap")) {
      const auto pair = syntax::parse_remap(text);
      if (!pair) continue;
      if (!wires.insert(pair->wire).second)
        add("remap", to_text(text), fmt::format("{} to be remapped once only", pair->wire));
      if (!locals.insert(pair->local).second)
        add("remap", to_text(text), fmt::format("{} to be the target once only", pair->local));
      config_.remap.push_back(*pair);
    }
    for (const std::string& text : values_.list("identity_names")) {
      const auto name = syntax::parse_identity_name(text);
      if (!name) continue;
      const bool taken =
          std::any_of(config_.identity_names.begin(), config_.identity_names.end(),
                      [&](const auto& other) { return other.second == name->second; });
      if (taken || !config_.identity_names.insert(*name).second)
        add("identity_names", to_text(text), "each identity, and each name, once only");
    }
    if (config_.prefix != syntax::kByIdentity) {
      if (!config_.identity_names.empty())
        add("identity_names", "", "prefix: by_identity too, else it has no effect");
      config_.names = NameMap(config_.prefix, config_.remap);
      return;
    }
    if (config_.role == Role::kClient) {
      add("prefix", to_text(config_.prefix),
          "a prefix, e.g. /robot1: a client has one peer, without an identity");
    } else if (config_.auth.method == "none") {
      add("prefix", to_text(config_.prefix), "a login (auth.method), else nobody has a name");
    }
    config_.names = PeerNames(config_.identity_names, config_.remap);
  }

  void read_policy(ReadAt moment) {
    RuleSet set = read_rules(values_, config_.is_robot(), moment, around_, parsed_.problems,
                             config_.warnings);
    check_named(values_, config_, set.rules, parsed_.problems);
    config_.policy = Policy(std::move(set.rules));
    config_.default_rules = set.defaults;
    config_.clock_publish_period = set.clock_publish_period;
    config_.clock_identities = std::move(set.clock_identities);
    config_.clock_groups = std::move(set.clock_groups);
  }

  Parsed parsed_;  // stands before values_, which adds problems to it
  CheckedValues values_;
  const Surroundings& around_;
  Config config_;
};

// Whether the parameter has this value already, given or by default.
bool has(const Config& config, std::string_view key, const KeySpec& spec,
         const std::optional<ParameterValue>& value) {
  return value ? value_in(config.given, spec, key) == value : !config.given.contains(key);
}

}  // namespace

Parsed parse_config(const ParameterMap& parameters, Role role, const Surroundings& surroundings,
                    ReadAt moment) {
  return ConfigMaker(parameters, role, surroundings).make(moment);
}

Parsed apply_change(const Config& current, const std::vector<Parameter>& changes,
                    const Surroundings& surroundings) {
  ParameterMap next = current.given;
  std::vector<Problem> problems;
  for (const auto& [key, value] : changes) {
    const KeySpec* spec = find_key(key);
    const bool fixed = spec != nullptr && !spec->changeable;
    if (fixed && !has(current, key, *spec, value)) {  // mutant: fixed_keys
      problems.push_back({key, value && !spec->secret ? to_text(*value) : "",
                          "no change at run time; set it in the parameter file and restart"});
    } else if (fixed) {
      continue;
    } else if (value) {
      next.insert_or_assign(key, *value);
    } else {
      next.erase(key);
    }
  }
  Surroundings around = surroundings;
  around.token_in_environment |= current.token_in_environment;
  Parsed parsed = ConfigMaker(next, current.role, around).make(ReadAt::kRunning);
  const auto clock = [](const Config& of) {
    return std::tie(of.clock_publish_period, of.clock_identities, of.clock_groups);
  };
  if (parsed.config && clock(*parsed.config) != clock(current)) {
    problems.push_back({"rules", "", "the rule with clock: publish to stay; restart to change it"});
  }
  // Problems of fixed keys are reported before those that follow from them.
  parsed.problems.insert(parsed.problems.begin(), problems.begin(), problems.end());
  if (!parsed.problems.empty()) parsed.config.reset();  // mutant: whole_change
  return parsed;
}

SideOptions side_options(const Config& config) {
  SideOptions options = config.limits;
  options.role = config.role;
  options.policy = config.policy;
  options.names = config.names;
  options.audits = !config.audit.file.empty();
  options.login_method = config.auth.method;
  options.credential.assign(config.auth.token.begin(), config.auth.token.end());
  options.clock_publish_period = config.clock_publish_period;
  options.clock_identities = config.clock_identities;
  options.clock_groups = config.clock_groups;
  return options;
}

}  // namespace connect_bridge
