#include "core/policy/policy.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "unit/policy/words.hpp"

namespace connect_bridge::policy_test {
namespace {

Rule rule(std::string name) {
  Rule result;
  result.name = std::move(name);
  return result;
}

Rule all_topics(std::string name) {
  auto result = rule(std::move(name));
  result.opens[Direction::kExport][OpenedBy::kTopics] =
      result.opens[Direction::kImport][OpenedBy::kTopics] = patterns({"/**"});
  return result;
}

// The rule's name, or "denied".
std::string decided(const Policy& policy, Direction direction, InterfaceKind kind,
                    std::string_view name, std::string_view type = {},
                    const Identity& who = kOperator) {
  if (type.empty()) {
    type = kind == kTopic ? kTwist : kind == kService ? kSetBool : kFibonacci;
  }
  const auto decision = policy.decide(direction, kind, name, type, who);
  return decision ? decision->rule : "denied";
}

TEST(Policy, WithoutRulesEverythingIsDenied) {
  EXPECT_EQ(decided(Policy{}, kExport, kTopic, "/tf"), "denied");
  EXPECT_EQ(decided(Policy{{rule("empty")}}, kImport, kService, "/tf"), "denied");
}

TEST(Policy, DirectionsAndKindsAreApart) {
  auto all = rule("r");
  all.opens[Direction::kExport][OpenedBy::kTopics] = patterns({"/a"});
  all.opens[Direction::kImport][OpenedBy::kTopics] = patterns({"/b"});
  all.opens[Direction::kExport][OpenedBy::kServices] = patterns({"/c"});
  all.opens[Direction::kImport][OpenedBy::kServices] = patterns({"/d"});
  all.opens[Direction::kExport][OpenedBy::kActions] = patterns({"/e"});
  all.opens[Direction::kImport][OpenedBy::kActions] = patterns({"/f"});
  const Policy policy({all});
  const std::pair<std::string, std::pair<Direction, InterfaceKind>> cells[] = {
      {"/a", {kExport, kTopic}},   {"/b", {kImport, kTopic}},  {"/c", {kExport, kService}},
      {"/d", {kImport, kService}}, {"/e", {kExport, kAction}}, {"/f", {kImport, kAction}}};
  for (const auto& [name, own] : cells) {
    for (const auto& [other_name, cell] : cells) {
      EXPECT_EQ(decided(policy, cell.first, cell.second, name),
                name == other_name ? "r" : "denied");
    }
    EXPECT_EQ(decided(policy, kImport, InterfaceKind::kOther, name), "denied");
  }
}

TEST(Policy, TheFirstMatchDecidesTheTreatment) {
  auto camera = rule("camera");
  camera.opens[Direction::kExport][OpenedBy::kTopics] = patterns({"/camera/**"});
  camera.treatment.priority = Priority::kBulk;
  camera.treatment.max_rate = 15;
  const Policy policy({camera, all_topics("base")});
  const auto decision = policy.decide(kExport, kTopic, "/camera/image", kTwist, kNobody);
  ASSERT_TRUE(decision);
  EXPECT_EQ(decision->rule, "camera");
  EXPECT_EQ(decision->treatment, camera.treatment);
  EXPECT_EQ(decided(policy, kImport, kTopic, "/camera/image"), "base");
  EXPECT_EQ(policy.decide(kExport, kTopic, "/tf", kTwist, kNobody)->treatment, Treatment{});
}

TEST(Policy, ADenyOfAnyRuleWinsBeforeAndBehind) {
  auto secrets = rule("secrets");
  secrets.deny = patterns({"/camera/secret/**", "/cmd_*"});
  for (const auto& rules :
       {std::vector{secrets, all_topics("all")}, std::vector{all_topics("all"), secrets}}) {
    const Policy policy(rules);
    EXPECT_EQ(decided(policy, kExport, kTopic, "/camera/secret/image"), "denied");
    EXPECT_EQ(decided(policy, kImport, kTopic, "/cmd_vel"), "denied");
    EXPECT_EQ(decided(policy, kExport, kTopic, "/camera/image"), "all");
  }
}

TEST(Policy, ADenyCoversHiddenNames) {
  auto open = rule("open");
  open.opens[Direction::kExport][OpenedBy::kTopics] = patterns({"/camera/_raw", "/other/_raw"});
  auto closed = rule("closed");
  closed.deny = patterns({"/camera/**"});
  const Policy policy({open, closed});
  EXPECT_EQ(decided(policy, kExport, kTopic, "/camera/_raw"), "denied");
  EXPECT_EQ(decided(policy, kExport, kTopic, "/other/_raw"), "open");
}

TEST(Policy, TypesNarrowWhatIsAllowedNotWhatIsDenied) {
  auto drive = rule("drive");
  drive.opens[Direction::kImport][OpenedBy::kTopics] = patterns({"/cmd_vel"});
  drive.types = {"a/msg/B", kTwist};
  drive.deny = patterns({"/secret"});
  const Policy policy({drive, all_topics("base")});
  EXPECT_EQ(decided(policy, kImport, kTopic, "/cmd_vel", kTwist), "drive");
  EXPECT_EQ(decided(policy, kImport, kTopic, "/cmd_vel", "std_msgs/msg/String"), "base");
  EXPECT_EQ(decided(policy, kImport, kTopic, "/secret", "std_msgs/msg/String"), "denied");
}

TEST(Policy, IdentitiesAndGroupsNarrowAllOfARule) {
  auto named = all_topics("named");
  named.identities = {"bob", "anna"};
  auto grouped = all_topics("grouped");
  grouped.groups = {"ops"};
  auto guests = rule("guests");
  guests.identities = {"guest", ""};
  guests.deny = patterns({"/**"});
  const Policy policy({
      guests,
      named,
      grouped,
  });
  const auto who = [&](const Identity& identity) {
    return decided(policy, kExport, kTopic, "/tf", kTwist, identity);
  };
  EXPECT_EQ(who({"anna", {}, 0}), "named");
  EXPECT_EQ(who({"carl", {"day", "ops"}, 0}), "grouped");
  EXPECT_EQ(who({"carl", {"bob"}, 0}), "denied");
  EXPECT_EQ(who({"ops", {}, 0}), "denied");
  EXPECT_EQ(who({"guest", {"ops"}, 0}), "denied");
  EXPECT_EQ(who(kNobody), "denied");
  EXPECT_EQ(who({"", {"ops"}, 0}), "grouped");  // an empty name is no identity of a rule
}

TEST(Policy, NamesThatAreNotCanonicalAreDenied) {
  const Policy policy({all_topics("all")});
  for (const auto* name : {"", "tf", "/tf/", "//tf", "/a/../b", "/a b", "/**", "/a/*"}) {
    EXPECT_EQ(decided(policy, kImport, kTopic, name), "denied") << name;
  }
}

TEST(Policy, ThousandsOfNamesAndTensOfRulesAreFast) {
  std::vector<Rule> rules;
  for (int i = 0; i < 50; ++i) {
    auto next = rule("r" + std::to_string(i));
    const auto text = "/robot/part_" + std::to_string(i) + "/**/state_*";
    next.opens[Direction::kExport][OpenedBy::kTopics] = patterns({text, "/x/**/y", "/*/z"});
    next.deny = patterns({"/**/secret/**"});
    rules.push_back(next);
  }
  const Policy policy(rules);
  const auto begin = std::chrono::steady_clock::now();
  int allowed = 0;
  for (int i = 0; i < 5000; ++i) {
    const auto name =
        "/robot/part_" + std::to_string(i % 100) + "/arm/joint/state_" + std::to_string(i);
    allowed += policy.decide(kExport, kTopic, name, kTwist, kNobody) ? 1 : 0;
  }
  EXPECT_EQ(allowed, 2500);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

}  // namespace
}  // namespace connect_bridge::policy_test
