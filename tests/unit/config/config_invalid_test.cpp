// One case per mistake that an operator can make, with the program's message.
#include <gmock/gmock.h>

#include "config/config.hpp"
#include "yaml_parameters.hpp"

namespace connect_bridge {
namespace {

using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;

struct Case {
  const char* name;
  Role role;
  const char* yaml;
  const char* said;  // part of the problem's text
};

constexpr Role kServer = Role::kServer;
constexpr Role kClient = Role::kClient;

// Only one problem is expected of each; clients get a url unless they give one.
const Case kCases[] = {
    {"unknown", kServer, "listen: {prot: 1}",
     "listen.prot: 1 is wrong, expected a known "
     "parameter; did you mean listen.port?"},
    {"unknown_part", kServer, "port: 1", "did you mean listen.port?"},
    {"unknown_of_the_other_role", kServer, "ulr: ws://localhost",
     "did you mean url? That is a parameter of the client"},
    {"unknown_part_of_the_other_role", kClient, "listen: {prot: 1}",
     "did you mean listen.port? That is a parameter of the server"},
    {"unknown_far", kServer, "wombat_colour: red", "docs/config.md lists them"},
    {"unknown_secret", kServer, "auth: {tokn: hush}",
     "auth.tokn: (hidden) is wrong, expected a known parameter; did you mean auth.token?"},
    {"unknown_rule_key", kServer,
     "{rules: [a], rule: {a: {import_topics: [/a], prioriti: urgent}}}",
     "did you mean rule.a.priority?"},
    {"rules_for_rule", kServer, "rules: {a: {types: [a/msg/B]}}", "did you mean rule.a.types?"},
    {"wrong_role_client", kClient, "listen: {port: 1}",
     "listen.port: 1 is wrong, expected nothing: it is a parameter of the server, this is a "
     "client"},
    {"wrong_role_server", kServer, "url: ws://localhost", "it is a parameter of the client"},
    {"status_address", kServer, "status: {listen: 'robot:9091'}", "an IP address and a port"},
    {"status_without_a_port", kServer, "status: {listen: 127.0.0.1}", "an IP address and a port"},
    {"status_of_a_client_beyond_loopback", kClient, "status: {listen: '0.0.0.0:9091'}",
     "ssh -L 9091:127.0.0.1:9091"},
    {"status_without_tls", kServer,
     "{status: {listen: '0.0.0.0:9091', groups: [ops]}, auth: {token_file: a}}",
     "tls.certificate and tls.private_key too beyond loopback; or 127.0.0.1:9091"},
    {"status_without_tokens", kServer,
     "{status: {listen: '[::]:9091', groups: [ops]}, auth: {token: abcdefghijklmnopq}, "
     "tls: {certificate: a, private_key: b}}",
     "auth.token_file too beyond loopback"},
    {"status_for_nobody", kServer,
     "{status: {listen: '0.0.0.0:9091'}, auth: {token_file: a}, "
     "tls: {certificate: a, private_key: b}}",
     "status.groups: expected the groups that may look"},
    {"status_groups_on_loopback", kServer,
     "{status: {listen: '127.0.0.1:9091', groups: [ops]}, auth: {token_file: a}}",
     "status.listen beyond loopback too"},
    {"status_where_clients_come", kServer,
     "{status: {listen: '127.0.0.1:9090'}, auth: {token_file: a}}",
     "status.listen: \"127.0.0.1:9090\" is wrong, expected another port than listen.port"},
    {"identities_of_a_nameless_key", kClient,
     "{tls: {pin: [47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=]}, rules: [a], rule: {a: "
     "{import_topics: [/a], identities: [x]}}}",
     "rule.a.identities: [\"x\"] is wrong, expected the server's name behind its key in tls.pin"},
    {"pin_with_a_name_that_is_none", kClient, "{tls: {pin: [\"x desk\"]}}",
     "alone or with a space, the server's name and its groups behind it"},
    {"groups_without_tls", kClient,
     "{url: ws://localhost, rules: [a], rule: {a: {import_topics: [/a], groups: [x]}}}",
     "expected a url that begins with wss://, else the rule applies to nobody"},
    {"link_local_without_interface", kClient, "url: 'wss://[fe80::1]:9090/'", "[fe80::1%eth0]"},
    {"relay_without_a_pin", kClient, "url: wss://robot7@relay.example/",
     "tls.pin: expected tls.pin, or tls.ca with an authority of your own and a "
     "certificate for 'robot7'"},
    {"relay_without_tls", kClient, "url: ws://robot7@localhost/", "wss://, since it leads through"},
    {"relay_and_a_password", kClient, "url: wss://a:b@relay.example/", "without user and password"},
    {"relay_and_no_name", kClient, "url: wss://Robot_7@relay.example/", "a to z, 0 to 9 and -"},
    {"relay_without_a_token", kServer,
     "{listen: {relay: {url: wss://a@relay.example/}}, tls: {certificate: a, private_key: b}}",
     "listen.relay.token_file: expected"},
    {"relay_at_a_plain_server", kServer,
     "listen: {relay: {url: wss://a@relay.example/, token_file: t}}",
     "tls.certificate and tls.private_key too: clients verify this server through the relay"},
    {"relay_without_a_login", kServer,
     "{listen: {relay: {url: wss://a@relay.example/, token_file: t}}, auth: {method: none}, "
     "tls: {certificate: a, private_key: b}}",
     "a login (token), since others connect through the relay"},
    {"relay_without_a_url", kServer, "listen: {relay: {token_file: t}}",
     "listen.relay.url too, else it has no effect"},
    {"relay_with_a_path", kServer,
     "{listen: {relay: {url: wss://a@relay.example/b, token_file: t}}, "
     "tls: {certificate: a, private_key: b}}",
     "this robot's name and the relay"},
    {"bool", kServer, "allow_plaintext: 1", "expected true or false"},
    {"integer", kServer, "listen: {port: 9090.0}",
     "listen.port: 9090.0 is wrong, expected a whole number from 0 to 65535"},
    {"integer_text", kServer, "listen: {port: '9090'}", "\"9090\" is wrong, expected a whole"},
    {"range", kServer, "listen: {port: 65536}", "65536 is wrong, expected a whole number"},
    {"range_low", kServer, "max_message_size: 10", "from 1024 to 1073741824"},
    {"number_nan", kServer, "dead_after: .nan", "expected a number from 0.2 to 300"},
    {"number_text", kServer, "dead_after: soon", "\"soon\" is wrong, expected a number"},
    {"word", kServer, "auth: {method: passwrd}",
     "expected one of token, jwt, service, plugin, certificate, none"},
    {"text_not_string", kServer, "listen: {address: 5}", "5 is wrong, expected"},
    {"token_not_string", kServer, "auth: {token: 12345}",
     "auth.token: (hidden) is wrong, expected 1 to 3900 printable"},
    {"token_spaces", kServer, "auth: {token: 'a b'}", "auth.token: (hidden) is wrong"},
    {"list", kServer, "{rules: [a], rule: {a: {import_topics: [/a], types: a/msg/B}}}",
     "rule.a.types: \"a/msg/B\" is wrong, expected a list of strings: [\"a/msg/B\"]"},
    {"pattern", kServer, "{rules: [a], rule: {a: {import_topics: [cmd_vel]}}}",
     "rule.a.import_topics: \"cmd_vel\" is wrong, expected an absolute name"},
    {"pattern_service", kServer, "{rules: [a], rule: {a: {export_services: [/a//b]}}}",
     "rule.a.export_services: \"/a//b\" is wrong"},
    {"pattern_deny", kServer, "{rules: [a], rule: {a: {deny: ['/a b']}}}", "rule.a.deny: \"/a b\""},
    {"pattern_twice", kServer, "{rules: [a], rule: {a: {deny: [/a, /a]}}}",
     "\"/a\" is wrong, expected each entry only once"},
    {"type", kServer, "{rules: [a], rule: {a: {import_topics: [/a], types: [Twist]}}}",
     "\"Twist\" is wrong, expected the full name of a type"},
    {"priority", kServer, "{rules: [a], rule: {a: {import_topics: [/a], priority: fast}}}",
     "expected one of urgent, high, normal, bulk"},
    {"compression", kServer, "{rules: [a], rule: {a: {import_topics: [/a], compression: gzip}}}",
     "expected auto, none, lz4, zstd"},
    {"compression_level", kServer,
     "{rules: [a], rule: {a: {import_topics: [/a], compression: 'zstd:20'}}}",
     "\"zstd:20\" is wrong"},
    {"max_age", kServer, "{rules: [a], rule: {a: {import_topics: [/a], max_age: -1}}}",
     "rule.a.max_age: -1 is wrong, expected a number from 0.001"},
    {"halt_after", kServer, "{rules: [a], rule: {a: {import_topics: [/a], halt_after: 0.01}}}",
     "rule.a.halt_after: 0.01 is wrong, expected a number from 0.05"},
    {"calls_max", kServer, "{rules: [a], rule: {a: {export_services: [/a], calls_max: 0}}}",
     "rule.a.calls_max: 0 is wrong, expected a whole number from 1 to 1000"},
    {"server_queue", kServer, "{rules: [a], rule: {a: {export_services: [/a], server_queue: -1}}}",
     "rule.a.server_queue: -1 is wrong, expected a whole number from 0 to 1000"},
    {"call_timeout", kServer, "{rules: [a], rule: {a: {export_services: [/a], call_timeout: 0}}}",
     "rule.a.call_timeout: 0 is wrong, expected a number from 0.01"},
    {"cancel_after", kServer, "{rules: [a], rule: {a: {export_actions: [/a], cancel_after: 0}}}",
     "rule.a.cancel_after: 0 is wrong, expected a number from 0.1"},
    {"graph", kServer, "graph: node", "expected one of merged, nodes"},
    {"pattern_action", kServer, "{rules: [a], rule: {a: {import_actions: [fib]}}}",
     "rule.a.import_actions: \"fib\" is wrong"},
    {"list_without_brackets", kServer, "{rules: [a], rule: {a: {deny: \"/a, /b\"}}}",
     "expected a list of strings: [\"/a\", \"/b\"]"},
    {"pattern_node", kServer, "{rules: [a], rule: {a: {parameters: [/n/]}}}",
     "rule.a.parameters: \"/n/\" is wrong"},
    {"parameters_not_listed", kServer, "{rules: [a], rule: {a: {parameters: /n}}}",
     "expected a list of strings: [\"/n\"]"},
    {"qos", kServer, "{rules: [a], rule: {a: {import_topics: [/a], qos: {reliability: sure}}}}",
     "expected one of best_effort, reliable"},
    {"qos_depth", kServer, "{rules: [a], rule: {a: {import_topics: [/a], qos: {depth: 0}}}}",
     "rule.a.qos.depth: 0 is wrong"},
    {"clock_without_topic", kClient,
     "{rules: [a], rule: {a: {import_topics: [/a], clock: publish}}}",
     "rule.a.clock: \"publish\" is wrong, expected /clock among import_topics"},
    {"clock_export", kClient, "{rules: [a], rule: {a: {export_topics: [/clock], clock: publish}}}",
     "expected import_topics: [/clock] too"},
    {"clock_twice", kClient,
     "{rules: [a, b], rule: {a: {import_topics: [/clock], clock: publish}, "
     "b: {import_topics: [/clock], clock: publish}}}",
     "rule.b.clock: \"publish\" is wrong, expected only one rule"},
    {"rule_undefined", kServer, "rules: [ghost]",
     "rules: \"ghost\" is wrong, expected a rule that"},
    {"rule_unlisted", kServer, "rule: {a: {import_topics: [/a]}}",
     "rule.a: expected its name in `rules`"},
    {"rule_renamed", kServer, "{rules: [look], rule: {watch: {import_topics: [/a]}}}",
     "rules: \"look\" is wrong, expected a rule that is defined: did you mean watch?"},
    {"number_in_quotes", kServer, "{listen: {port: '9090'}}",
     "listen.port: \"9090\" is wrong, expected a whole number from 0 to 65535, without quotation "
     "marks"},
    {"switch_in_quotes", kServer, "allow_plaintext: 'true'",
     "expected true or false, without quotation marks"},
    {"rule_twice", kServer, "{rules: [a, a], rule: {a: {import_topics: [/a]}}}",
     "rules: \"a\" is wrong, expected each entry only once"},
    {"rule_name", kServer, "{rules: ['a b']}", "expected a name of letters, digits and '_'"},
    {"rule_empty", kServer, "{rules: [a], rule: {a: {priority: bulk}}}",
     "this rule allows nothing"},
    {"rule_empty_list", kServer, "{rules: [a], rule: {a: {import_topics: []}}}",
     "this rule allows nothing"},
    {"identities_without_login", kServer,
     "{auth: {method: none}, rules: [a], rule: {a: {import_topics: [/a], identities: [x]}}}",
     "rule.a.identities: [\"x\"] is wrong, expected a login"},
    {"address", kServer, "listen: {address: robot.local}", "expected an IP address"},
    {"address_octet", kServer, "listen: {address: 127.0.0.256}", "expected an IP address"},
    {"public_without_login", kServer,
     "{listen: {address: 0.0.0.0}, auth: {method: none}, "
     "tls: {certificate: /c, private_key: /k}}",
     "auth.method: \"none\" is wrong, expected a login (token)"},
    {"public_without_tls", kServer, "listen: {address: '::'}",
     "listen.address: \"::\" is wrong, expected tls.certificate and tls.private_key"},
    {"public_too_without_tls", kServer, "listen: {address: '127.0.0.1, 10.0.0.1'}",
     "listen.address: \"127.0.0.1, 10.0.0.1\" is wrong, expected tls.certificate"},
    {"any_without_tls", kServer, "listen: {address: '*'}", "listen.address: \"*\" is wrong"},
    {"certificate_alone", kServer, "tls: {certificate: /c.pem}", "tls.private_key: expected"},
    {"key_alone", kServer, "tls: {private_key: /k.pem}", "tls.certificate: expected"},
    {"ca_alone", kServer, "tls: {ca: /ca.pem}", "tls.ca: expected tls.certificate"},
    {"token_twice", kServer, "auth: {token: abc, token_file: /t}",
     "expected either auth.token or auth.token_file"},
    {"token_unused", kServer, "auth: {method: none, token: abc}",
     "auth.token: expected auth.method: token too"},
    {"token_of_other_method", kServer,
     "auth: {method: jwt, jwt_keys: /k, jwt_issuer: a, jwt_audience: b, token: abc}",
     "auth.token: expected auth.method: token too"},
    {"jwt_without_keys", kServer, "auth: {method: jwt, jwt_issuer: a, jwt_audience: b}",
     "auth.jwt_keys: expected a value: auth.method: jwt needs it"},
    {"jwt_unused", kServer, "auth: {jwt_keys: /k}", "auth.jwt_keys: expected auth.method: jwt too"},
    {"jwt_keys_without_tls", kServer,
     "auth: {method: jwt, jwt_keys: 'http://id.example/k', jwt_issuer: i, jwt_audience: a}",
     "expected a URL that begins with https://"},
    {"service_without_address", kServer, "auth: {method: service}",
     "auth.service: expected a value: auth.method: service needs it"},
    {"plugin_without_library", kServer, "auth: {method: plugin}",
     "auth.plugin: expected a value: auth.method: plugin needs it"},
    {"plugin_at_client", kClient, "auth: {method: plugin, plugin: /p}",
     "it is a parameter of the server"},
    {"no_url", kClient, "url: ''", "url: \"\" is wrong, expected a URL"},
    {"url_scheme", kClient, "url: https://robot.example", "expected a URL that begins with wss://"},
    {"url_host", kClient, "url: 'wss:///path'", "expected a URL"},
    {"url_port", kClient, "url: wss://robot.example:0/", "expected a URL"},
    {"url_password", kClient, "url: wss://me:hush@robot.example/",
     "\"wss://...@robot.example/\" is wrong, expected a URL without user and password"},
    {"url_plain", kClient, "url: ws://robot.example",
     "expected wss://, since the server is on another machine"},
    {"tls_unused", kClient, "{url: ws://localhost, tls: {ca: /ca.pem}}",
     "tls.ca: expected a url that begins with wss://"},
    {"pin_of_a_server", kServer, "tls: {pin: [AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA=]}",
     "tls.pin"},
    {"pin_without_tls", kClient,
     "{url: ws://localhost, tls: {pin: [AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA=]}}",
     "tls.pin: expected a url that begins with wss://"},
    {"pin_in_hexadecimal", kClient, "tls: {pin: ['0badcafe']}",
     "tls.pin: \"0badcafe\" is wrong, expected a SHA-256 of a public key in base64"},
    {"certificates_of_no_authority", kServer,
     "{auth: {method: certificate}, tls: {certificate: /c, private_key: /k}}",
     "tls.ca: expected the authority that signs the clients' certificates"},
    {"no_certificate_to_log_in_with", kClient, "auth: {method: certificate}",
     "tls.certificate: expected the certificate to log in with"},
    {"token_beside_certificate", kClient,
     "{auth: {method: certificate, token: abc}, tls: {certificate: /c, private_key: /k}}",
     "auth.token: expected auth.method: token too"},
    {"proxy_by_name", kServer, "listen: {trusted_proxies: [proxy.example]}",
     "listen.trusted_proxies: \"proxy.example\" is wrong, expected an IP address or a range"},
    {"proxy_range", kServer, "listen: {trusted_proxies: [10.0.0.0/33]}", "expected an IP address"},
    {"proxy_everybody", kServer, "listen: {trusted_proxies: [\"::/0\"]}", "expected an IP address"},
    {"proxy_without_login", kServer,
     "{auth: {method: none}, listen: {trusted_proxies: [127.0.0.1]}}",
     "auth.method: \"none\" is wrong, expected a login (token), since others connect through the "
     "proxies"},
    {"proxy_header_alone", kServer, "listen: {proxy_header: proxy_protocol}",
     "listen.proxy_header: expected listen.trusted_proxies too"},
    {"prefix", kServer, "prefix: robot1", "expected an absolute name without a '/' at its end"},
    {"remap", kServer, "remap: ['/a:/b']", "\"/a:/b\" is wrong, expected two absolute names"},
    {"identity_names", kServer,
     "{prefix: by_identity, identity_names: ['robot-7'], auth: {method: certificate}, "
     "tls: {certificate: /c, private_key: /k, ca: /a}}",
     "expected \"identity:=name\""},
    {"identity_names_twice", kServer,
     "{prefix: by_identity, identity_names: ['a-b:=a', 'c-d:=a'], auth: {method: certificate}, "
     "tls: {certificate: /c, private_key: /k, ca: /a}}",
     "expected each identity, and each name, once only"},
    {"identity_names_alone", kServer, "identity_names: ['robot-7:=robot7']",
     "identity_names: expected prefix: by_identity too"},
    {"by_identity_at_a_client", kClient, "prefix: by_identity", "expected a prefix, e.g. /robot1"},
    {"remap_twice", kServer, "remap: ['/a:=/b', '/a:=/c']", "expected /a to be remapped once only"},
    {"remap_target", kServer, "remap: ['/a:=/c', '/b:=/c']", "expected /c to be the target once"},
    {"congestion", kServer, "congestion_control: 'B B R'", "e.g. bbr"},
};

void PrintTo(const Case& one, std::ostream* out) {
  *out << one.name;
}

class ConfigInvalid : public testing::TestWithParam<Case> {};

TEST_P(ConfigInvalid, IsToldOnce) {
  const Case& one = GetParam();
  ParameterMap map = yaml(one.yaml);
  if (one.role == Role::kClient) map.emplace("url", "wss://robot.example");
  const Parsed parsed = parse_config(map, one.role, kWithToken);
  EXPECT_FALSE(parsed.config);
  const std::string text = problems_text(parsed);
  EXPECT_EQ(parsed.problems.size(), 1U) << text;
  EXPECT_THAT(text, HasSubstr(one.said));
  EXPECT_THAT(text, Not(AnyOf(HasSubstr("hush"), HasSubstr("12345"))));
}

INSTANTIATE_TEST_SUITE_P(Mistakes, ConfigInvalid, testing::ValuesIn(kCases),
                         [](const auto& one) { return std::string(one.param.name); });

// `rules` rules of `patterns` names each to import; the names are padded to `bytes`.
ParameterMap importing(std::size_t rules, std::size_t patterns, std::size_t bytes = 0) {
  ParameterMap map;
  std::vector<std::string> names, topics;
  for (std::size_t i = 0; i < rules; ++i) names.push_back("r" + std::to_string(i));
  for (std::size_t i = 0; i < patterns; ++i) {
    topics.push_back("/t" + std::to_string(i) + "_");
    topics.back().resize(std::max(bytes, topics.back().size()), 'x');
  }
  for (const std::string& name : names) map["rule." + name + ".import_topics"] = topics;
  map["rules"] = names;
  return map;
}

TEST(ConfigInvalidMore, NoPeerRefusesWhatIsAnnounced) {
  const auto said = [](const ParameterMap& map) {
    return problems_text(parse_config(map, Role::kServer, kWithToken));
  };
  EXPECT_EQ(said(importing(2, 2048)), "");
  EXPECT_EQ(said(importing(1024, 4)), "");
  EXPECT_THAT(
      said(importing(3, 1366)),
      HasSubstr("rules: expected at most 4096 import patterns, parameters, deny patterns and "
                "types in all rules together; there are 4098"));
  ParameterMap more = importing(1, 4094);
  more["rule.r0.types"] = std::vector<std::string>{"p/msg/A"};
  more["rule.r0.deny"] = std::vector<std::string>{"/a", "/b"};
  more["rule.r0.export_topics"] = std::vector<std::string>{"/exports/are/not/announced"};
  EXPECT_THAT(said(more), HasSubstr("there are 4097"));
  EXPECT_THAT(said(importing(1025, 1)), HasSubstr("at most 1024 rules that import something"));
  EXPECT_THAT(said(importing(1, 4096, 255)), HasSubstr("at most 262144 bytes"));
  // Wildcards are named where most of them are.
  std::vector<std::string> stars, long_stars;
  for (int i = 100; i < 355; ++i) stars.push_back("/a/*_" + std::to_string(i));
  for (int i = 100; i < 228; ++i)
    long_stars.push_back("/long/*" + std::string(28, 'x') + std::to_string(i));
  ParameterMap wild = importing(2, 40);
  wild["rule.r0.deny"] = std::vector<std::string>{"/x/*"};
  wild["rule.r1.import_services"] = stars;
  EXPECT_EQ(said(wild), "");
  wild["rule.r0.import_actions"] = std::vector<std::string>{"/x/*"};
  EXPECT_THAT(said(wild), HasSubstr("rule.r1.import_services: expected at most 256 patterns with * "
                                    "in what all rules import and deny together; there are 257"));
  ParameterMap longer = importing(1, 1);
  longer["rule.r0.import_parameters"] = long_stars;
  EXPECT_EQ(said(longer), "");
  longer["rule.r0.deny"] = std::vector<std::string>{"/x/*"};
  EXPECT_THAT(said(longer), HasSubstr("rule.r0.import_parameters: expected at most 4096"));
  // A rule may be for one peer only; who is in its groups is known when somebody logs in.
  ParameterMap narrow = importing(2, 2049);
  narrow["rule.r0.groups"] = std::vector<std::string>{"a"};
  EXPECT_THAT(said(narrow), HasSubstr("there are 4098"));
}

TEST(ConfigInvalidMore, MissingUrlAndToken) {
  const Parsed parsed = parse_config({}, Role::kClient, {});
  ASSERT_EQ(parsed.problems.size(), 2U);
  EXPECT_THAT(to_text(parsed.problems[0]), HasSubstr("url: expected the server to connect to"));
  EXPECT_THAT(to_text(parsed.problems[1]), HasSubstr("CONNECT_BRIDGE_TOKEN"));
}

}  // namespace
}  // namespace connect_bridge
