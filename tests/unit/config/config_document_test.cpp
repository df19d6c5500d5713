// The table seen from outside: descriptors, manual, examples.
#include <gmock/gmock.h>

#include "config/document.hpp"
#include "config/key_search.hpp"
#include "unit/source_text.hpp"
#include "yaml_parameters.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST(ConfigDescribe, DescriptorsOfTheRole) {
  const Config config = config_of(yaml(R"(
auth: {token: 0123456789abcdef}
rules: [drive]
rule: {drive: {import_topics: [/cmd_vel], priority: urgent, max_age: 0.3}}
)"),
                                  Role::kServer);
  std::map<std::string, ParameterDescriptor> found;
  for (const ParameterDescriptor& one : describe_parameters(config)) found[one.name] = one;
  EXPECT_FALSE(found.contains("auth.token"));
  EXPECT_FALSE(found.contains("url"));
  EXPECT_EQ(found.at("listen.port").value, ParameterValue{std::int64_t{9090}});
  EXPECT_EQ(found.at("listen.port").range.value().max, 65535);
  EXPECT_TRUE(found.at("listen.port").read_only);
  EXPECT_EQ(found.at("rule.drive.max_age").value, ParameterValue{0.3});
  EXPECT_THAT(found.at("listen.port").description, HasSubstr("A change needs a restart."));
  EXPECT_FALSE(found.at("rule.drive.max_age").read_only);
  EXPECT_FALSE(found.at("log_level").read_only);
  EXPECT_THAT(found.at("log_level").description, Not(HasSubstr("restart")));
  EXPECT_THAT(found.at("rule.drive.priority").constraints, "one of urgent, high, normal, bulk");
  EXPECT_TRUE(describe_parameter("rule.new.types", Role::kClient));
  EXPECT_FALSE(describe_parameter("auth.token", Role::kClient));
  EXPECT_FALSE(describe_parameter("listen.port", Role::kClient));
}

// Whoever is in an unprotected graph can set the parameters of every node.
TEST(ConfigDescribe, NoNodeOfTheGraphChoosesAFileOrEndsTheAudit) {
  for (const KeySpec& spec : key_table()) {
    const bool decides = spec.key.find("file") != std::string::npos || spec.section == "Audit log";
    EXPECT_FALSE(decides && spec.changeable) << spec.key;
  }
}

TEST(ConfigDocument, HasEveryKeyAsTheTableHasIt) {
  const std::string document = test::source_text("docs/config.md");
  for (const KeySpec& spec : key_table()) {
    EXPECT_THAT(document, HasSubstr("| `" + spec.key + (spec.changeable ? "` * |" : "` |")));
    EXPECT_THAT(spec.help, Not(IsEmpty())) << spec.key;
  }
  EXPECT_THAT(document, HasSubstr(config_tables()))
      << "make it again: ctl config-doc docs/config.md";
}

TEST(ConfigDocument, ReplacesWhatStandsBetweenTheMarks) {
  const std::string document = test::source_text("docs/config.md");
  std::string old = document;
  old.insert(old.find("| `listen.port`"), "| `gone` |\n");
  EXPECT_EQ(config_document(old), document);
  EXPECT_FALSE(config_document("a text without marks"));
  EXPECT_FALSE(config_document(document.substr(0, document.find("| `listen.port`"))));
}

TEST(ConfigDocument, HelpNamesWhatIsImportant) {
  const std::string server = help_text(Role::kServer);
  EXPECT_THAT(server, HasSubstr("--ros-args --params-file"));
  EXPECT_THAT(server, HasSubstr("  listen.port (default 9090)\n      TCP port to listen on"));
  EXPECT_THAT(help_text(Role::kClient), HasSubstr("  url\n      The server to connect to"));
}

// Every ```yaml block is valid as it stands or, when it begins with `rules`, inside a node.
int count_valid_examples(const std::string& document) {
  const std::string fence = "```yaml\n";
  int examples = 0;
  for (std::size_t at = document.find(fence); at != std::string::npos;
       at = document.find(fence, at)) {
    at += fence.size();
    const YAML::Node node = YAML::Load(document.substr(at, document.find("```", at) - at));
    ParameterMap map;
    if (node["rules"]) {
      flatten(node, "", map);
    } else {
      map = parameters_of(node);
    }
    const Role role = map.contains("url") ? Role::kClient : Role::kServer;
    EXPECT_THAT(problems_text(parse_config(map, role, kWithToken)), IsEmpty());
    ++examples;
  }
  return examples;
}

TEST(ConfigDocument, ItsExamplesAreValid) {
  EXPECT_GE(count_valid_examples(test::source_text("docs/config.md")), 5);
  EXPECT_GE(count_valid_examples(test::source_text("docs/logins.md")), 2);
  EXPECT_GE(count_valid_examples(test::source_text("docs/proxies.md")), 3);
}

TEST(ConfigExamples, AreValid) {
  const auto check = [](const std::string& path, Role role) {
    const ParameterMap map = parameters_of(YAML::Load(test::source_text(path)));
    const Config config = config_of(map, role);
    EXPECT_THAT(config.warnings, IsEmpty()) << path;
    EXPECT_THAT(config.policy.rules(), Not(IsEmpty())) << path;
  };
  check("config/robot.yaml", Role::kServer);
  check("config/robot_tls.yaml", Role::kServer);
  check("config/operator.yaml", Role::kClient);
}

// A table whose rows contradict themselves would refuse its own defaults.
TEST(ConfigTable, DefaultsAreValid) {
  for (const Role role : {Role::kServer, Role::kClient}) {
    ParameterMap map;
    for (const KeySpec& spec : key_table()) {
      if (spec.fallback && rule_of(spec.key).empty() && is_used_by(spec, role)) {
        map[spec.key] = *spec.fallback;
      }
    }
    if (role == Role::kClient) map["url"] = "wss://robot.example";
    EXPECT_TRUE(parse_config(map, role, kWithToken).config);
  }
}

// The example of read-only operators allows what the text before it says.
TEST(ConfigDocument, WatchersOnlyLook) {
  const std::string text = test::source_text("docs/config.md");
  const std::size_t mark = text.find("<!-- test: read only -->");
  ASSERT_NE(mark, std::string::npos);
  const std::size_t begin = text.find("```yaml\n", mark) + 8;
  const Config config =
      config_of(yaml(text.substr(begin, text.find("```", begin) - begin)), Role::kServer);
  const auto allows = [&](const std::string& group, Direction direction, InterfaceKind kind,
                          const std::string& name, const std::string& type) {
    return config.policy.decide(direction, kind, name, type, {"someone", {group}}).has_value();
  };
  for (const Direction direction : {Direction::kExport, Direction::kImport}) {
    const bool out = direction == Direction::kExport;
    for (const std::string group : {"watchers", "drivers"}) {
      const bool drives = group == "drivers";
      EXPECT_EQ(allows(group, direction, InterfaceKind::kTopic, "/scan", "p/msg/T"), out);
      EXPECT_EQ(allows(group, direction, InterfaceKind::kTopic, "/cmd_vel", "p/msg/T"),
                out || drives);
      EXPECT_EQ(
          allows(group, direction, InterfaceKind::kTopic, "/camera/workshop/image", "p/msg/T"),
          out && drives);
      EXPECT_EQ(allows(group, direction, InterfaceKind::kService, "/s", "p/srv/T"), out && drives);
      EXPECT_EQ(allows(group, direction, InterfaceKind::kAction, "/a", "p/action/T"),
                out && drives);
      EXPECT_EQ(allows(group, direction, InterfaceKind::kService, "/node/set_parameters",
                       "rcl_interfaces/srv/SetParameters"),
                out && drives);
    }
    EXPECT_FALSE(allows("others", direction, InterfaceKind::kTopic, "/scan", "p/msg/T"));
  }
}

}  // namespace
}  // namespace connect_bridge
