// How a rule says that a type may have another definition here.
#include <gmock/gmock.h>

#include "config/config.hpp"
#include "config/explain.hpp"
#include "yaml_parameters.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Config, ATypeOfAnotherDefinitionIsUsedOnlyWhereARuleSaysSo) {
  const Config config = config_of(yaml(R"(
rules: [a, b]
rule:
  a: {import_topics: [/a]}
  b: {import_topics: [/b], allow_type_mismatch: true}
)"),
                                  Role::kServer);
  const auto& rules = config.policy.rules();
  ASSERT_EQ(rules.size(), 2U);
  EXPECT_FALSE(rules[0].treatment.allow_type_mismatch);
  EXPECT_TRUE(rules[1].treatment.allow_type_mismatch);
  EXPECT_THAT(explain(config), HasSubstr("/b; allow_type_mismatch true"));
  EXPECT_THAT(explain(config), Not(HasSubstr("/a; allow")));
}

TEST(Config, AMessageTypeThatIsNotInstalledIsToldWhereThatMatters) {
  const ParameterMap map = yaml(
      "{rules: [a], rule: {a: {import_topics: [/a], "
      "types: [std_msgs/msg/Strin, std_msgs/msg/String, std_srvs/srv/Empty]}}}");
  Surroundings around;
  around.token_in_environment = true;
  EXPECT_EQ(problems_text(parse_config(map, Role::kServer, around)), "");
  around.installed = [](const std::string& type) { return type == "std_msgs/msg/String"; };
  const std::string told = problems_text(parse_config(map, Role::kServer, around));
  EXPECT_THAT(told, HasSubstr("rule.a.types: std_msgs/msg/Strin is wrong"));
  EXPECT_THAT(told, HasSubstr("installed here (package std_msgs)"));
  EXPECT_THAT(told, Not(HasSubstr("Empty")));
}

}  // namespace
}  // namespace connect_bridge
