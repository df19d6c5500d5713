// How a rule says what is compressed.
#include <gmock/gmock.h>

#include "config/config.hpp"
#include "config/explain.hpp"
#include "yaml_parameters.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;

TEST(Config, CompressionIsAutomaticUnlessARuleSaysOtherwise) {
  const Config config = config_of(yaml(R"(
rules: [a, b, c]
rule:
  a: {export_topics: [/a]}
  b: {export_topics: [/b], compression: auto}
  c: {export_topics: [/c], compression: none}
)"),
                                  Role::kServer);
  const auto& rules = config.policy.rules();
  ASSERT_EQ(rules.size(), 3U);
  EXPECT_TRUE(rules[0].treatment.compression == Compression{.automatic = true});
  EXPECT_TRUE(rules[1].treatment.compression == Compression{.automatic = true});
  EXPECT_TRUE(rules[2].treatment.compression == Compression{});
  EXPECT_THAT(explain(config), HasSubstr("c: the peer may receive /c; compression none"));
}

TEST(Config, ARuleSaysWhatACloudMayLose) {
  const Config config = config_of(yaml(R"(
rules: [a, b]
rule:
  a: {export_topics: [/a]}
  b: {export_topics: [/b], lossy: never, max_error: 0.02, grid: 0.1}
)"),
                                  Role::kServer);
  const auto& rules = config.policy.rules();
  ASSERT_EQ(rules.size(), 2U);
  EXPECT_FALSE(rules[0].treatment.lossy);
  EXPECT_EQ(rules[0].treatment.max_error, 0.005);
  EXPECT_EQ(rules[0].treatment.grid, 0);
  EXPECT_EQ(rules[1].treatment.lossy, Lossy::kNever);
  EXPECT_EQ(rules[1].treatment.max_error, 0.02);
  EXPECT_EQ(rules[1].treatment.grid, 0.1);
  EXPECT_THAT(explain(config), HasSubstr("lossy never; max_error 0.02 m; grid 0.1 m"));
}

TEST(Config, AClientWithoutRulesCompressesAutomatically) {
  const Config config = config_of(yaml("url: ws://localhost"), Role::kClient);
  ASSERT_EQ(config.policy.rules().size(), 1U);
  EXPECT_TRUE(config.policy.rules()[0].treatment.compression.automatic);
}

}  // namespace
}  // namespace connect_bridge
