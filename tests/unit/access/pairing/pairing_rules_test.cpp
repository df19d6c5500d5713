// What a pairing lets the operator do, and whether the owner has changed it.
#include "access/pairing/pairing_rules.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace connect_bridge {
namespace {

using Texts = std::vector<std::string>;

TEST(PairingRules, OperatingIsMoreThanLooking) {
  const ParameterMap looks = robot_rules(false), operates = robot_rules(true);
  EXPECT_EQ(looks.at("rule.look.deny"), ParameterValue(Texts{"/rosout"}));
  EXPECT_FALSE(looks.contains("rule.operate.import_topics"));
  EXPECT_EQ(operates.at("rules"), ParameterValue(Texts({"look", "operate"})));
  for (const char* right :
       {"import_topics", "export_services", "export_actions", "export_parameters"})
    EXPECT_TRUE(operates.contains(std::string{"rule.operate."} + right)) << right;
}

TEST(PairingRules, WhatTheOwnerHasChangedIsTheirs) {
  EXPECT_FALSE(has_own_rules({}));
  EXPECT_FALSE(has_own_rules({{"url", std::string{"wss://desk/"}}}));
  for (const bool operates : {false, true}) {
    ParameterMap stored = robot_rules(operates);
    stored["url"] = std::string{"wss://desk/"};
    EXPECT_FALSE(has_own_rules(stored));
    EXPECT_EQ(rules_of(stored), robot_rules(operates));
    stored["rule.look.deny"] = Texts{"/rosout", "/camera/**"};
    EXPECT_TRUE(has_own_rules(stored));
  }
}

}  // namespace
}  // namespace connect_bridge
