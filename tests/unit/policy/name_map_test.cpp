#include <gtest/gtest.h>

#include "core/policy/policy.hpp"

namespace connect_bridge {
namespace {

TEST(NameMap, WithoutSettingsNamesStay) {
  const NameMap names;
  EXPECT_EQ(names.to_local("/tf"), "/tf");
  EXPECT_EQ(names.to_wire("/tf"), "/tf");
}

TEST(NameMap, ThePrefixIsAWholeToken) {
  const NameMap names("/robot1", {});
  EXPECT_EQ(names.to_local("/tf"), "/robot1/tf");
  EXPECT_EQ(names.to_wire("/robot1/tf"), "/tf");
  EXPECT_EQ(names.to_wire("/robot1/a/b"), "/a/b");
  EXPECT_EQ(names.to_wire("/robot1"), std::nullopt);
  EXPECT_EQ(names.to_wire("/robot10/tf"), std::nullopt);
  EXPECT_EQ(names.to_wire("/tf"), std::nullopt);
}

TEST(NameMap, SloppyPrefixesMeanTheSame) {
  for (const auto* prefix : {"/robot1/", "robot1", "robot1//"}) {
    EXPECT_EQ(NameMap(prefix, {}).to_local("/tf"), "/robot1/tf") << prefix;
  }
  EXPECT_EQ(NameMap("/", {}).to_local("/tf"), "/tf");
}

TEST(NameMap, ARemapWinsInBothDirections) {
  const NameMap names("/robot1", {{"/cmd_vel", "/teleop/cmd_vel"}, {"/tf", "/tf"}});
  EXPECT_EQ(names.to_local("/cmd_vel"), "/teleop/cmd_vel");
  EXPECT_EQ(names.to_wire("/teleop/cmd_vel"), "/cmd_vel");
  EXPECT_EQ(names.to_wire("/robot1/cmd_vel"), std::nullopt);  // it is not at both places
  EXPECT_EQ(names.to_local("/tf"), "/tf");
  EXPECT_EQ(names.to_wire("/tf"), "/tf");
  EXPECT_EQ(names.to_local("/cmd_vel/x"), "/robot1/cmd_vel/x");
}

TEST(NameMap, WhatIsMappedComesBack) {
  const NameMap names("/r", {{"/a", "/b"}, {"/b", "/a"}, {"/c/d", "/r/e"}});
  for (const std::string wire : {"/a", "/b", "/c/d", "/x/y"}) {
    EXPECT_EQ(names.to_wire(names.to_local(wire)), wire);
  }
}

TEST(NameMap, ThePartsOfAnActionGoWhereItGoes) {
  const NameMap names("/robot1", {{"/fib", "/operator/fib"}});
  EXPECT_EQ(names.to_local("/fib/_action/feedback"), "/operator/fib/_action/feedback");
  EXPECT_EQ(names.to_wire("/operator/fib/_action/feedback"), "/fib/_action/feedback");
  EXPECT_EQ(names.to_wire("/robot1/fib/_action/feedback"), std::nullopt);
  EXPECT_EQ(names.to_local("/nav/_action/status"), "/robot1/nav/_action/status");
  EXPECT_EQ(names.to_local("/_action/status"), "/robot1/_action/status");
}

TEST(NameMap, WhatBridgesSayToEachOtherIsNotVisible) {
  EXPECT_EQ(NameMap().to_wire("/_connect_bridge/claims"), std::nullopt);
  EXPECT_EQ(NameMap("", {{"/x", "/_connect_bridge/x"}}).to_wire("/_connect_bridge/x"),
            std::nullopt);
  EXPECT_EQ(NameMap().to_wire("/_connect_bridge/fib/_action/status"), std::nullopt);
}

}  // namespace
}  // namespace connect_bridge
