#include "config/config.hpp"

#include <gmock/gmock.h>

#include "config/explain.hpp"
#include "yaml_parameters.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr char kDrive[] = R"(
rules: [drive]
rule: {drive: {import_topics: [/cmd_vel], priority: urgent, max_age: 0.3}}
)";

TEST(Config, ServerDefaults) {
  const Config config = config_of({}, Role::kServer);
  EXPECT_EQ(config.listen_address, "127.0.0.1");
  EXPECT_EQ(config.listen.port, 9090);
  EXPECT_EQ(config.socket.congestion_control, "auto");
  EXPECT_TRUE(config.carries_types_not_installed);
  EXPECT_THAT(config.policy.rules(), IsEmpty());
  EXPECT_THAT(config.warnings, ElementsAre(HasSubstr("no peer may exchange anything")));

  // Without parameters the core's own numbers hold.
  const SideOptions made = side_options(config);
  const SideOptions core;
  EXPECT_TRUE(made.resumes_exported);
  EXPECT_EQ(made.dead_after, core.dead_after);
  EXPECT_EQ(made.login_timeout, core.login_timeout);
  EXPECT_EQ(made.reassembly.message_bytes_max, core.reassembly.message_bytes_max);
  EXPECT_EQ(made.reassembly.open_bytes_max, core.reassembly.open_bytes_max);
  EXPECT_EQ(made.links_max, core.links_max);
  EXPECT_EQ(made.identity_links_max, core.identity_links_max);
  EXPECT_EQ(made.mirrors_max, core.mirrors_max);
  EXPECT_EQ(made.mirror_bytes_max, core.mirror_bytes_max);
  EXPECT_EQ(made.proxy_nodes, core.proxy_nodes);
}

TEST(Config, ClientNeedsOnlyUrlAndToken) {
  const Config config = config_of({{"url", "wss://robot.example/connect"}}, Role::kClient);
  EXPECT_TRUE(config.dial.url.secure);
  EXPECT_EQ(config.dial.url.host, "robot.example");
  EXPECT_EQ(config.dial.url.port, 443);
  EXPECT_EQ(config.dial.url.target, "/connect");
  EXPECT_TRUE(config.default_rules);
  EXPECT_TRUE(side_options(config).proxy_nodes);
  const Config merged = config_of({{"url", "ws://localhost"}, {"graph", "merged"}}, Role::kClient);
  EXPECT_FALSE(side_options(merged).proxy_nodes);
  const Identity nobody;
  const auto topic = InterfaceKind::kTopic;
  const std::string type = "std_msgs/msg/String";
  EXPECT_TRUE(config.policy.decide(Direction::kImport, topic, "/a/b", type, nobody));
  EXPECT_TRUE(config.policy.decide(Direction::kExport, topic, "/a", type, nobody));
  EXPECT_FALSE(config.policy.decide(Direction::kImport, topic, "/rosout", type, nobody));
  for (const auto direction : {Direction::kImport, Direction::kExport}) {
    const auto allowed = [&](const Interface& what) {
      return config.policy.decide(direction, what, nobody).has_value();
    };
    const auto service = InterfaceKind::kService;
    // The server calls nothing here, whatever its own rules say.
    const bool imported = direction == Direction::kImport;
    EXPECT_EQ(allowed({service, "/a/s", "std_srvs/srv/SetBool"}), imported);
    EXPECT_EQ(allowed({service, "/a/n/get_parameters", "rcl_interfaces/srv/GetParameters"}),
              imported);
    EXPECT_EQ(allowed({topic, kParameterEvents, kParameterEventType, {}, "/a/n"}), imported);
    EXPECT_FALSE(allowed({service, "/_a/get_parameters", "rcl_interfaces/srv/GetParameters"}));
    EXPECT_EQ(config.policy.decide(direction, InterfaceKind::kAction, "/f", "p/action/F", nobody)
                  .has_value(),
              imported);
  }
  EXPECT_EQ(side_options(config).role, Role::kClient);
  EXPECT_FALSE(side_options(config).resumes_exported);
  EXPECT_EQ(side_options(config).login_method, "token");
}

TEST(Config, UrlsAreTakenApart) {
  const Config v6 = config_of({{"url", "ws://[::1]:9091"}}, Role::kClient);
  EXPECT_FALSE(v6.dial.url.secure);
  EXPECT_EQ(v6.dial.url.host, "::1");
  EXPECT_EQ(v6.dial.url.port, 9091);
  EXPECT_EQ(v6.dial.url.target, "/");
  EXPECT_EQ(config_of({{"url", "ws://localhost/a?b=c"}}, Role::kClient).dial.url.target, "/a?b=c");
}

TEST(Config, RuleReachesTheCore) {
  const Config config = config_of(yaml(R"(
rules: [a]
rule:
  a:
    import_topics: [/cmd_vel, "/arm/*"]
    types: [geometry_msgs/msg/Twist]
    deny: [/arm/secret]
    identities: [ops]
    groups: [crew]
    priority: high
    compression: "zstd:7"
    max_rate: 15
    max_age: 0.3
    max_bytes_per_second: 1000
    queue_bytes_max: 4096
    calls_max: 5
    server_queue: 3
    call_timeout: 2.5
    cancel_after: 1.5
    qos:
      {reliability: best_effort, durability: transient_local, depth: 3}
)"),
                                  Role::kServer);
  ASSERT_EQ(config.policy.rules().size(), 1U);
  const Rule& rule = config.policy.rules()[0];
  EXPECT_EQ(rule.name, "a");
  ASSERT_EQ(rule.opens[Direction::kImport][OpenedBy::kTopics].size(), 2U);
  EXPECT_EQ(rule.opens[Direction::kImport][OpenedBy::kTopics][1].text(), "/arm/*");
  EXPECT_EQ(rule.deny.size(), 1U);
  EXPECT_THAT(rule.identities, ElementsAre("ops"));
  EXPECT_THAT(rule.groups, ElementsAre("crew"));
  Treatment expected;
  expected.priority = Priority::kHigh;
  expected.compression = {Codec::kZstd, 7};
  expected.max_rate = 15;
  expected.bytes_per_second_max = 1000;
  expected.max_age = std::chrono::milliseconds(300);
  expected.queue_bytes_max = 4096;
  expected.qos = {Reliability::kBestEffort, Durability::kTransientLocal, 3};
  expected.calls_max = 5;
  expected.server_queue = 3;
  expected.call_timeout = std::chrono::milliseconds(2500);
  expected.cancel_after = std::chrono::milliseconds(1500);
  EXPECT_TRUE(rule.treatment == expected);
}

TEST(Config, PatternsOfEveryKindReachTheCore) {
  const Config config = config_of(yaml(R"(
rules: [a]
rule:
  a:
    export_services: [/a]
    import_services: [/b]
    export_actions: [/c]
    import_actions: [/d]
    export_parameters: [/g]
    import_parameters: [/h]
    parameters: [/e, "/f/**"]
)"),
                                  Role::kServer);
  ASSERT_EQ(config.policy.rules().size(), 1U);
  const Rule& rule = config.policy.rules()[0];
  const auto texts = [](const std::vector<Pattern>& patterns) {
    std::string all;
    for (const Pattern& pattern : patterns) all += pattern.text() + " ";
    return all;
  };
  EXPECT_EQ(texts(rule.opens[Direction::kExport][OpenedBy::kServices]), "/a ");
  EXPECT_EQ(texts(rule.opens[Direction::kImport][OpenedBy::kServices]), "/b ");
  EXPECT_EQ(texts(rule.opens[Direction::kExport][OpenedBy::kActions]), "/c ");
  EXPECT_EQ(texts(rule.opens[Direction::kImport][OpenedBy::kActions]), "/d ");
  EXPECT_EQ(texts(rule.opens[Direction::kExport][OpenedBy::kParameters]), "/g /e /f/** ");
  EXPECT_EQ(texts(rule.opens[Direction::kImport][OpenedBy::kParameters]), "/h ");
  EXPECT_EQ(rule.treatment.calls_max, 64U);
  EXPECT_EQ(rule.treatment.server_queue, 10U);
  EXPECT_EQ(rule.treatment.call_timeout, kForever);
  EXPECT_THAT(config.warnings, IsEmpty());
}

TEST(Config, LimitsAndNamesReachTheCore) {
  const Config config = config_of(yaml(R"(
graph: nodes
max_message_size: 1048576
dead_after: 5
connections_max: 2
memory_max: 8388608
prefix: /robot1
remap: ["/scan:=/laser"]
auth: {token: 0123456789abcdef}
)"),
                                  Role::kServer);
  const SideOptions options = side_options(config);
  EXPECT_EQ(options.reassembly.message_bytes_max, 1048576U);
  EXPECT_EQ(options.reassembly.open_bytes_max, 256U << 20);
  EXPECT_EQ(options.dead_after, std::chrono::seconds(5));
  EXPECT_EQ(options.links_max, 2U);
  EXPECT_EQ(options.mirror_bytes_max, 4U << 20);
  EXPECT_TRUE(options.proxy_nodes);
  const NameMap names = options.names.of("").value();
  EXPECT_EQ(names.to_local("/odom"), "/robot1/odom");
  EXPECT_EQ(names.to_local("/scan"), "/laser");
  EXPECT_EQ(options.credential.size(), 16U);
}

TEST(Config, PublishedClockIsNotForwardedToo) {
  const Config config = config_of(yaml(R"(
url: ws://localhost
rules: [all]
rule: {all: {import_topics: ["/**"], export_topics: ["/**"], clock: publish}}
)"),
                                  Role::kClient);
  const auto decide = [&](Direction direction) {
    return config.policy.decide(direction, InterfaceKind::kTopic, "/clock",
                                "rosgraph_msgs/msg/Clock", Identity{});
  };
  EXPECT_FALSE(decide(Direction::kImport));
  EXPECT_FALSE(decide(Direction::kExport));
  EXPECT_EQ(side_options(config).clock_publish_period, std::chrono::milliseconds(10));
  EXPECT_THAT(explain(config), HasSubstr("published on /clock every 10 ms"));
}

TEST(Config, RosKeysAndEmptyListsOfAnyTypePass) {
  const Config config = config_of({{"use_sim_time", true},
                                   {"qos_overrides./tf.publisher.depth", std::int64_t{5}},
                                   {"rules", std::vector<bool>{}},
                                   {"remap", std::vector<double>{}}},
                                  Role::kServer);
  EXPECT_FALSE(config.given.contains("use_sim_time"));
}

TEST(Config, AllProblemsAtOnce) {
  const Parsed parsed = parse_config(yaml(R"(
listen: {address: 0.0.0.0, port: 70000}
auth: {method: none}
rules: [drive, ghost]
rule: {drive: {import_topics: [cmd_vel], priority: fast, typs: [a]}}
)"),
                                     Role::kServer, {});
  EXPECT_FALSE(parsed.config);
  EXPECT_EQ(parsed.problems.size(), 7U) << problems_text(parsed);
}

TEST(Config, PlaintextIsAllowedOnlyWithAWarning) {
  const Config config =
      config_of(yaml(std::string("allow_plaintext: true\nlisten: {address: 0.0.0.0}") + kDrive),
                Role::kServer);
  EXPECT_THAT(config.warnings, ElementsAre(HasSubstr("without TLS")));
}

// ---- changes at run time
// --------------------------------------------------------------------------

TEST(ConfigChange, TreatmentAndRulesOneByOne) {
  Config config = config_of(yaml(kDrive), Role::kServer);
  const auto apply = [&](const std::string& key, const std::optional<ParameterValue>& value) {
    // The environment may have been scrubbed of the token since.
    const Parsed parsed = apply_change(config, {{key, value}}, {});
    EXPECT_THAT(problems_text(parsed), IsEmpty());
    if (parsed.config) config = *parsed.config;
  };
  apply("rule.drive.max_age", 1.0);
  EXPECT_EQ(config.policy.rules()[0].treatment.max_age, std::chrono::seconds(1));
  apply("rule.drive.max_age", std::nullopt);
  EXPECT_EQ(config.policy.rules()[0].treatment.max_age, kForever);

  apply("rule.see.export_topics", std::vector<std::string>{"/tf"});
  EXPECT_EQ(config.policy.rules().size(), 1U);
  EXPECT_THAT(config.warnings, ElementsAre(HasSubstr("rule.see: has no effect")));
  apply("rules", std::vector<std::string>{"see"});
  ASSERT_EQ(config.policy.rules().size(), 1U);
  EXPECT_EQ(config.policy.rules()[0].name, "see");
}

TEST(ConfigChange, AllOrNothing) {
  const Config config = config_of(yaml(kDrive), Role::kServer);
  const Parsed parsed = apply_change(
      config, {{"rule.drive.max_age", 1.0}, {"rule.drive.priority", "fast"}}, kWithToken);
  EXPECT_FALSE(parsed.config);
  EXPECT_THAT(problems_text(parsed), HasSubstr("rule.drive.priority: \"fast\" is wrong"));
}

TEST(ConfigChange, FixedKeysStay) {
  const Config config = config_of(yaml(kDrive), Role::kServer);
  const auto change = [&](const std::string& key, const ParameterValue& value) {
    const Parsed parsed = apply_change(config, {{key, value}}, kWithToken);
    EXPECT_EQ(parsed.config.has_value(), parsed.problems.empty());
    return problems_text(parsed);
  };
  EXPECT_THAT(change("listen.port", std::int64_t{1234}), HasSubstr("no change at run time"));
  EXPECT_THAT(change("listen.port", std::int64_t{9090}), IsEmpty());
  EXPECT_THAT(change("auth.token", "0123456789abcdef"), Not(HasSubstr("0123456789abcdef")));
  EXPECT_THAT(change("rule.drive.clock", "publish"), HasSubstr("no change at run time"));
  EXPECT_THAT(change("listen.prot", std::int64_t{1}), HasSubstr("did you mean listen.port?"));
  EXPECT_THAT(change("use_sim_time", true), IsEmpty());
}

TEST(ConfigChange, TheClockRuleStays) {
  const Config config = config_of(yaml("{url: 'ws://localhost', rules: [c], "
                                       "rule: {c: {import_topics: [/clock], clock: publish}}}"),
                                  Role::kClient);
  const Parsed parsed = apply_change(config, {{"rules", std::vector<std::string>{}}}, kWithToken);
  EXPECT_THAT(problems_text(parsed), HasSubstr("clock: publish to stay"));
  EXPECT_FALSE(parsed.config);
}

// ---- words
// ----------------------------------------------------------------------------------------

TEST(ConfigExplain, Server) {
  const Config config = config_of(yaml(R"(
listen: {address: 0.0.0.0}
tls: {certificate: /c.pem, private_key: /k.pem}
auth: {token: 0123456789abcdef}
rules: [drive, camera]
rule:
  drive: {import_topics: [/cmd_vel], types: [geometry_msgs/msg/Twist], identities: [ops],
          priority: urgent, max_age: 0.3, halt_after: 0.5}
  camera: {export_topics: ["/camera/**", /map], deny: [/camera/x], priority: bulk, max_rate: 15,
           compression: lz4}
)"),
                                  Role::kServer);
  EXPECT_EQ(
      explain(config),
      "listens: on 0.0.0.0, port 9090, with TLS (certificate /c.pem); reachable by "
      "others\n"
      "login: token, taken from the parameter auth.token\n"
      "rules, the first that allows an interface decides:\n"
      "  drive: the peer may publish to /cmd_vel (geometry_msgs/msg/Twist only), if logged in "
      "as ops; priority urgent; max_age 0.3 s; halt_after 0.5 s\n"
      "  camera: the peer may receive /camera/** and /map; never /camera/x, whatever rules "
      "allow; priority bulk; compression lz4; max_rate 15.0 Hz\n");
}

TEST(ConfigExplain, ServicesActionsAndParameters) {
  const Config config = config_of(yaml(R"(
graph: nodes
rules: [calls, tune]
rule:
  calls: {export_services: [/a], import_services: [/b], export_actions: [/c], import_actions: [/d],
          types: [p/srv/A, p/action/C], calls_max: 8, server_queue: 0, call_timeout: 0.5,
          cancel_after: 5}
  tune: {parameters: [/e, "/f/**"], types: [p/srv/A], groups: [crew], deny: ["/**/set_parameters*"]}
)"),
                                  Role::kServer);
  const std::string text = explain(config);
  EXPECT_THAT(
      text,
      HasSubstr(
          "graph: what is imported belongs to nodes named as the peer's\n"
          "rules, the first that allows an interface decides:\n"
          "  calls: the peer may call /a (p/srv/A or p/action/C only); the peer may offer the "
          "services /b (p/srv/A or p/action/C only); the peer may use the actions /c (p/srv/A or "
          "p/action/C only); the peer may offer the actions /d (p/srv/A or p/action/C only); "
          "calls_max 8 calls; server_queue 0 requests; call_timeout 0.5 s; cancel_after 5.0 s\n"
          "  tune: the peer may read and set parameters of the nodes /e and "
          "/f/**, if logged in as a member of crew; never /**/set_parameters*, if logged in as a "
          "member of crew, whatever rules allow\n"));
}

TEST(ConfigExplain, Client) {
  const Config config =
      config_of({{"url", "wss://robot.example/c?key=hush"}, {"prefix", "/r1"}}, Role::kClient);
  const std::string text = explain(config);
  EXPECT_THAT(text,
              HasSubstr("connects to: wss://robot.example/c?..., with TLS; the certificate must "
                        "be for robot.example and signed by an authority the system trusts"));
  EXPECT_THAT(text, HasSubstr("environment variable CONNECT_BRIDGE_TOKEN"));
  EXPECT_THAT(text, HasSubstr("the peer's /x is /r1/x"));
  EXPECT_THAT(text, HasSubstr("all that the peer allows, but from here topics only"));
  EXPECT_THAT(
      text,
      HasSubstr("  default: the peer may publish to all topics, hidden ones too; the peer may "
                "receive all topics; the peer may offer all services, hidden ones too; the "
                "peer may offer all actions; the peer may offer parameters of all nodes; "
                "never /rosout, whatever rules allow\n"));
  EXPECT_THAT(text, Not(HasSubstr("hush")));
}

}  // namespace
}  // namespace connect_bridge
