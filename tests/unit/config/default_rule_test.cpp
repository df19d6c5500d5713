#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "config/explain.hpp"
#include "config/rule_reader.hpp"
#include "unit/config/yaml_parameters.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

// A server that spells a hidden name out can be used by a client without rules.
TEST(DefaultRule, ImportsHiddenNamesToo) {
  const Rule rule = default_rule();
  const auto imports = [&rule](std::string_view name) {
    return std::any_of(rule.opens[Direction::kImport][OpenedBy::kServices].begin(),
                       rule.opens[Direction::kImport][OpenedBy::kServices].end(),
                       [name](const Pattern& one) { return one.matches(name); });
  };
  EXPECT_TRUE(imports("/add"));
  EXPECT_TRUE(imports("/container/_container/load_node"));
  EXPECT_TRUE(imports("/add/_service_event"));
  EXPECT_TRUE(imports("/_hidden/a/_part/b"));
}

// Rights, and what holds after a break, follow from which end is the robot, not from who dials.
TEST(DefaultRule, IsOfTheEndThatIsNotTheRobot) {
  const std::string drives = "rules: [a]\nrule: {a: {parameters: [/arm]}}\n";
  const std::string url = "robot: client\nurl: 'ws://localhost'\n";
  const Config robot = config_of(yaml(url + drives), Role::kClient);
  EXPECT_TRUE(side_options(robot).resumes_exported);
  EXPECT_FALSE(side_options(robot).resumes_imported);
  EXPECT_FALSE(side_options(robot).proxy_nodes);
  EXPECT_EQ(robot.policy.rules()[0].opens[Direction::kExport][OpenedBy::kParameters].size(), 1U);
  EXPECT_THAT(config_of(yaml(url), Role::kClient).policy.rules(), IsEmpty());
  const Config desk = config_of(yaml("robot: client"), Role::kServer);
  EXPECT_FALSE(side_options(desk).resumes_exported);
  EXPECT_TRUE(side_options(desk).resumes_imported);
  EXPECT_TRUE(side_options(desk).proxy_nodes);
  EXPECT_TRUE(desk.default_rules);
  EXPECT_THAT(explain(desk), HasSubstr("robot: the client\n"));
  EXPECT_EQ(config_of(yaml("robot: client\n" + drives), Role::kServer)
                .policy.rules()[0]
                .opens[Direction::kImport][OpenedBy::kParameters]
                .size(),
            1U);
}

}  // namespace
}  // namespace connect_bridge
