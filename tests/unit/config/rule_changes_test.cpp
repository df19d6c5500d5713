// What a parameter file that was read again changes in a running program.
#include "config/rule_changes.hpp"

#include <gmock/gmock.h>

#include "yaml_parameters.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr char kBefore[] = R"(
listen: {port: 9090}
dead_after: 3
rules: [a, b, c]
rule:
  a: {export_topics: [/a]}
  b: {export_topics: [/b], max_rate: 10}
  c: {export_topics: [/c]}
)";

// The Config that the file makes of the one before.
Config after(const Config& before, const std::string& text) {
  FileChanges found = file_changes(before, yaml(text), {});
  EXPECT_THAT(found.problems, IsEmpty());
  const Parsed parsed = apply_change(before, found.changes, {});
  EXPECT_EQ(problems_text(parsed), "");
  return parsed.config.value_or(before);
}

TEST(RuleChanges, TellWhichRules) {
  const Config before = config_of(yaml(kBefore), Role::kServer);
  const Config now = after(before, R"(
rules: [d, b, a]
rule:
  a: {export_topics: [/a]}
  b: {export_topics: [/b], max_rate: 20}
  d: {export_topics: [/d]}
)");
  const RuleChanges changes = rule_changes(before, now);
  EXPECT_THAT(changes.added, ElementsAre("d"));
  EXPECT_THAT(changes.changed, ElementsAre("b"));
  EXPECT_THAT(changes.removed, ElementsAre("c"));
  EXPECT_TRUE(changes.reordered);
  EXPECT_EQ(to_text(changes), "1 added (d), 1 changed (b), 1 removed (c), in another order");
  EXPECT_EQ(now.policy.rules().size(), 3U);
  EXPECT_EQ(now.policy.rules()[0].name, "d");
}

TEST(RuleChanges, TheSameFileChangesNothing) {
  const Config before = config_of(yaml(kBefore), Role::kServer);
  const FileChanges found = file_changes(before, yaml(kBefore), {});
  EXPECT_THAT(found.changes, IsEmpty());
  EXPECT_THAT(found.fixed, IsEmpty());
  EXPECT_EQ(to_text(rule_changes(before, before)), "none changed");
}

TEST(RuleChanges, WhatWasSetMeanwhileIsAsTheFileSays) {
  const Config start = config_of(yaml(kBefore), Role::kServer);
  const Parsed set = apply_change(
      start, {{"rule.a.deny", std::vector<std::string>{"/a/x"}}, {"rule.b.max_rate", 99.0}}, {});
  ASSERT_TRUE(set.config);
  const Config now = after(*set.config, kBefore);
  EXPECT_EQ(now.given, start.given);
}

TEST(RuleChanges, WhatNeedsARestartIsNamed) {
  const Config before = config_of(yaml(kBefore), Role::kServer);
  const FileChanges found = file_changes(before, yaml(R"(
listen: {port: 9091}
max_message_size: 100000
rules: [a]
rule: {a: {export_topics: [/z]}}
)"),
                                         {});
  EXPECT_THAT(found.fixed, ElementsAre("listen.port", "max_message_size"));
  const Parsed parsed = apply_change(before, found.changes, {});
  ASSERT_TRUE(parsed.config) << "rules change all the same";
  EXPECT_EQ(parsed.config->listen.port, 9090);
  EXPECT_EQ(parsed.config->policy.rules().size(), 1U);
}

TEST(RuleChanges, SettingsThatMayChangeDo) {
  const std::string rules = "rules: [a]\nrule: {a: {export_topics: [/a]}}\n";
  const Config before =
      config_of(yaml(rules + "log_level: warn\nresume.seconds: 5"), Role::kServer);
  ASSERT_EQ(before.log_level, LogLevel::kWarn);
  const Config now = after(before, rules + "link.bytes_per_second: 5000\nresume.seconds: 7\n");
  EXPECT_EQ(now.limits.outbox.bytes_per_second_max, 5000U);
  EXPECT_EQ(now.limits.resume_for, std::chrono::seconds(7));
  EXPECT_EQ(now.log_level, std::nullopt);
  EXPECT_THAT(settings_changed(before, now),
              ElementsAre("log_level", "resume.seconds", "link.bytes_per_second"));
  EXPECT_TRUE(rule_changes(before, now).none());
  const Config again = after(now, rules);
  EXPECT_EQ(again.limits.outbox.bytes_per_second_max, 0U);
  EXPECT_EQ(again.limits.resume_for, std::chrono::seconds(60));
  EXPECT_THAT(file_changes(again, yaml(rules), {}).changes, IsEmpty()) << "once is enough";
}

// All or nothing, whichever of them is wrong.
TEST(RuleChanges, AWrongSettingKeepsTheRulesToo) {
  const Config before = config_of(yaml(kBefore), Role::kServer);
  const FileChanges found = file_changes(
      before, yaml("rules: [a]\nrule: {a: {export_topics: [/z]}}\nlog_level: loud"), {});
  EXPECT_THAT(found.changes, IsEmpty());
  ASSERT_EQ(found.problems.size(), 1U);
  EXPECT_THAT(to_text(found.problems[0]), HasSubstr("one of debug, info, warn, error"));
}

TEST(RuleChanges, AWrongFileChangesNothing) {
  const Config before = config_of(yaml(kBefore), Role::kServer);
  const FileChanges found = file_changes(before, yaml(R"(
rules: [a]
rule: {a: {export_topic: [/a], import_topics: [a/b]}}
)"),
                                         {});
  EXPECT_THAT(found.changes, IsEmpty());
  ASSERT_EQ(found.problems.size(), 2U);
  EXPECT_THAT(to_text(found.problems[0]) + to_text(found.problems[1]),
              HasSubstr("rule.a.export_topic"));
}

TEST(RuleChanges, AMissingRuleIsFoundWithTheWhole) {
  const Config before = config_of(yaml(kBefore), Role::kServer);
  const FileChanges found = file_changes(before, yaml("rules: [nobody]"), {});
  EXPECT_THAT(found.changes, IsEmpty());
  ASSERT_EQ(found.problems.size(), 1U);
  EXPECT_THAT(to_text(found.problems[0]), HasSubstr("nobody"));
}

// An empty file is valid for rcl, and a client without rules has the default ones.
TEST(RuleChanges, AFileThatAClientCouldNotStartWithDropsNoRules) {
  const std::string url = "url: 'ws://localhost'\n";
  const Config before =
      config_of(yaml(url + "rules: [a]\nrule: {a: {import_topics: [/a]}}"), Role::kClient);
  const FileChanges emptied = file_changes(before, {}, {});
  EXPECT_THAT(emptied.changes, IsEmpty());
  EXPECT_THAT(emptied.fixed, IsEmpty());
  ASSERT_EQ(emptied.problems.size(), 2U);
  EXPECT_THAT(to_text(emptied.problems[0]), HasSubstr("url"));
  EXPECT_THAT(to_text(emptied.problems[1]), HasSubstr("rules"));
  const FileChanges unlisted =
      file_changes(before, yaml(url + "rule: {a: {import_topics: [/a]}}"), {});
  EXPECT_THAT(unlisted.changes, IsEmpty());
  EXPECT_THAT(unlisted.problems, testing::SizeIs(1));
  const FileChanges other = file_changes(
      before, yaml(url + "rules: [b]\nrule: {a: {import_topics: [/a]}, b: {import_topics: [/b]}}"),
      {});
  EXPECT_THAT(other.problems, IsEmpty()) << "a rule that is not used is a warning while it runs";
}

TEST(RuleChanges, SecretsAreOfNoConcern) {
  auto map = yaml(kBefore);
  map["auth.token"] = "a-token-of-some-length";
  const Config before = config_of(map, Role::kServer);
  map["auth.token"] = "another-token-of-some-length";
  const FileChanges found = file_changes(before, map, {});
  EXPECT_THAT(found.fixed, ElementsAre("auth.token"));
  EXPECT_THAT(found.changes, IsEmpty());
}

TEST(ConfigChange, AClientThatLosesItsRulesDoesNotOpenUp) {
  const Config config = config_of(
      yaml("{url: 'ws://localhost', rules: [a], rule: {a: {import_topics: [/a]}}}"), Role::kClient);
  Surroundings with_token;
  with_token.token_in_environment = true;
  const Parsed parsed = apply_change(config, {{"rules", std::vector<std::string>{}}}, with_token);
  ASSERT_TRUE(parsed.config);
  EXPECT_THAT(parsed.config->policy.rules(), IsEmpty());
}

}  // namespace
}  // namespace connect_bridge
