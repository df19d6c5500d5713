#include <gtest/gtest.h>

#include "core/policy/names.hpp"

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

// All nodes of a graph look for the parameters of others there.
TEST(NameMap, ThereIsOneTopicOfParameterEvents) {
  const NameMap names("/robot1", {});
  EXPECT_EQ(names.to_local("/parameter_events"), "/parameter_events");
  EXPECT_EQ(names.to_wire("/parameter_events"), "/parameter_events");
  EXPECT_EQ(names.to_wire("/robot1/parameter_events"), std::nullopt);
  const NameMap moved("/robot1", {{"/parameter_events", "/events"}});
  EXPECT_EQ(moved.to_local("/parameter_events"), "/events");
  EXPECT_EQ(moved.to_wire("/parameter_events"), std::nullopt);
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

// ---- of each identity

TEST(PeerNames, OneMapIsForAll) {
  const PeerNames names = NameMap("/robot1", {});
  for (const char* identity : {"", "anna", "robot-7"})
    EXPECT_EQ(names.of(identity).value().to_local("/scan"), "/robot1/scan");
}

TEST(PeerNames, EachIdentityIsBelowItsOwnName) {
  const PeerNames names({{"robot-8", "eight"}}, {{"/tf", "/tf"}});
  const NameMap seven = names.of("robot7").value();
  EXPECT_EQ(seven.to_local("/scan"), "/robot7/scan");
  EXPECT_EQ(seven.to_wire("/robot7/cmd_vel"), "/cmd_vel");
  EXPECT_EQ(seven.to_wire("/eight/cmd_vel"), std::nullopt);
  EXPECT_EQ(seven.to_local("/tf"), "/tf");
  EXPECT_EQ(names.of("robot-8").value().to_local("/scan"), "/eight/scan");
}

TEST(PeerNames, WhatIsNoWordIsRefused) {
  const PeerNames names(PeerNames::Words{}, {});
  for (const char* identity :
       {"", "robot-7", "7", "_robot", "a/b", "/a", "https://ca.example/robot7",
        "r\xc3\xb6"
        "bot"}) {
    const auto map = names.of(identity);
    ASSERT_FALSE(map) << identity;
    EXPECT_EQ(map.error().code, CloseCode::kLoginRefused);
    EXPECT_NE(map.error().message.find("identity_names"), std::string::npos);
  }
  EXPECT_NE(names.of("robot-7").error().message.find("robot-7:=robot_7"), std::string::npos);
  EXPECT_NE(names.of("7").error().message.find("7:=robot7"), std::string::npos);
}

TEST(PeerNames, NoTwoIdentitiesShareAName) {
  const PeerNames names({{"robot-7", "robot7"}}, {});
  EXPECT_TRUE(names.of("robot-7"));
  EXPECT_FALSE(names.of("robot7"));
}

}  // namespace
}  // namespace connect_bridge
