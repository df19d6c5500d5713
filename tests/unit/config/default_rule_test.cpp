#include <gtest/gtest.h>

#include <algorithm>

#include "config/rule_reader.hpp"

namespace connect_bridge {
namespace {

// A server that spells a hidden name out can be used by a client without rules.
TEST(DefaultRule, ImportsHiddenNamesToo) {
  const Rule rule = default_rule();
  const auto imports = [&rule](std::string_view name) {
    return std::any_of(rule.import_services.begin(), rule.import_services.end(),
                       [name](const Pattern& one) { return one.matches(name); });
  };
  EXPECT_TRUE(imports("/add"));
  EXPECT_TRUE(imports("/container/_container/load_node"));
  EXPECT_TRUE(imports("/add/_service_event"));
  EXPECT_TRUE(imports("/_hidden/a/_part/b"));
}

}  // namespace
}  // namespace connect_bridge
