// Every kind of channel against every kind of rule: what opens actions and parameters, and that
// nothing else does.
#include <gtest/gtest.h>

#include "core/policy/peer_accepts.hpp"
#include "core/policy/policy.hpp"
#include "unit/policy/words.hpp"

namespace connect_bridge::policy_test {
namespace {

constexpr auto kGet = "rcl_interfaces/srv/GetParameters";
constexpr auto kSet = "rcl_interfaces/srv/SetParameters";

// The parts of the action /nav/fib, as an exporter would ask for them.
std::vector<Interface> parts() {
  return {{kService, "/nav/fib/_action/send_goal", "p/action/Fibonacci_SendGoal", kFibonacci},
          {kService, "/nav/fib/_action/cancel_goal", kCancel, kFibonacci},
          {kService, "/nav/fib/_action/get_result", "p/action/Fibonacci_GetResult", kFibonacci},
          {kTopic, "/nav/fib/_action/feedback", "p/action/Fibonacci_FeedbackMessage", kFibonacci},
          {kTopic, "/nav/fib/_action/status", kStatus, kFibonacci}};
}

std::vector<Interface> parameters() {
  return {{kService, "/nav/node/get_parameters", kGet},
          {kService, "/nav/node/set_parameters", kSet},
          {kService, "/nav/node/set_parameters_atomically",
           "rcl_interfaces/srv/SetParametersAtomically"},
          {kService, "/nav/node/list_parameters", "rcl_interfaces/srv/ListParameters"},
          {kService, "/nav/node/describe_parameters", "rcl_interfaces/srv/DescribeParameters"},
          {kService, "/nav/node/get_parameter_types", "rcl_interfaces/srv/GetParameterTypes"},
          {kTopic, kParameterEvents, kParameterEventType, {}, "/nav/node"}};
}

std::string decided(const Policy& policy, Direction direction, const Interface& what,
                    const Identity& who = kOperator) {
  const auto decision = policy.decide(direction, what, who);
  return decision ? decision->rule : "denied";
}

std::optional<Decision> events(const Policy& policy, Direction direction, const Identity& who) {
  return policy.decide_parameter_events(direction, kParameterEventType, who);
}

// How many of `all` the policy allows, each way, and a peer with its rules would take.
std::size_t opened(const Policy& policy, const std::vector<Interface>& all) {
  std::size_t exported = 0;
  std::size_t imported = 0;
  std::size_t accepted = 0;
  const PeerAccepts accepts(policy.accepts(kOperator));
  for (const auto& what : all) {
    exported += policy.decide(kExport, what, kOperator) ? 1 : 0;
    imported += policy.decide(kImport, what, kOperator) ? 1 : 0;
    accepted += accepts.takes(what) ? 1 : 0;
  }
  EXPECT_EQ(exported, imported);
  EXPECT_EQ(imported, accepted);
  return exported;
}

enum Key { kTopics = 1, kServices = 2, kActions = 4, kParameters = 8 };

// A rule with these patterns for these keys, both directions.
Rule rule(int keys, std::initializer_list<std::string_view> texts) {
  Rule result;
  result.name = "r";
  if (keys & kTopics)
    result.opens[Direction::kExport][OpenedBy::kTopics] =
        result.opens[Direction::kImport][OpenedBy::kTopics] = patterns(texts);
  if (keys & kServices)
    result.opens[Direction::kExport][OpenedBy::kServices] =
        result.opens[Direction::kImport][OpenedBy::kServices] = patterns(texts);
  if (keys & kActions)
    result.opens[Direction::kExport][OpenedBy::kActions] =
        result.opens[Direction::kImport][OpenedBy::kActions] = patterns(texts);
  if (keys & kParameters)
    result.opens[Direction::kExport][OpenedBy::kParameters] =
        result.opens[Direction::kImport][OpenedBy::kParameters] = patterns(texts);
  return result;
}

TEST(SideDoors, NoOtherPatternOpensAnAction) {
  const auto other = rule(
      kTopics | kServices | kParameters,
      {"/**", "/*", "/**/_action/*", "/**/_action/**", "/nav/fib/_action/*", "/nav/fib/_action/**",
       "/nav/fib", "/nav/fib/_action/send_goal", "/nav/fib/_action/status", "/*/*/_*/*"});
  EXPECT_EQ(opened(Policy{{other}}, parts()), 0U);
  EXPECT_EQ(opened(Policy{{rule(kActions, {"/nav/fib"})}}, parts()), 5U);
  EXPECT_EQ(opened(Policy{{rule(kActions, {"/**"})}}, parts()), 5U);
  EXPECT_EQ(opened(Policy{{rule(kActions, {"/nav", "/fib", "/*"})}}, parts()), 0U);
  // The name of a part opens no action, however it is spelled.
  EXPECT_EQ(
      opened(Policy{{rule(kActions, {"/nav/fib/_action/send_goal", "/**/_action/*"})}}, parts()),
      0U);
}

TEST(SideDoors, NoOtherPatternOpensParameters) {
  const auto other =
      rule(kTopics | kServices | kActions,
           {"/**", "/*", "/**/get_parameters", "/nav/node/*", "/nav/node/set_parameters",
            "/parameter_events", "/nav/node", "/*_events"});
  EXPECT_EQ(opened(Policy{{other}}, parameters()), 0U);
  EXPECT_EQ(opened(Policy{{rule(kParameters, {"/nav/node"})}}, parameters()), 7U);
  EXPECT_EQ(opened(Policy{{rule(kParameters, {"/nav/**"})}}, parameters()), 7U);
  EXPECT_EQ(opened(Policy{{rule(kParameters, {"/nav", "/*", "/nav/node/*", "/**/get_parameters",
                                              "/parameter_events"})}},
                   parameters()),
            0U);
}

TEST(SideDoors, NeitherActionsNorParametersOpenTopicsAndServices) {
  const auto other = rule(kActions | kParameters, {"/**"});
  const std::vector<Interface> plain = {{kTopic, "/cmd_vel", kTwist},
                                        {kService, "/nav/reset", kSetBool},
                                        {kService, "/nav/node/get_parameters", kSetBool},
                                        {kTopic, kParameterEvents, kTwist, {}, "/nav/node"}};
  EXPECT_EQ(opened(Policy{{other}}, plain), 0U);
  EXPECT_EQ(opened(Policy{{rule(kTopics, {"/**"})}}, plain), 1U);
  EXPECT_EQ(opened(Policy{{rule(kServices, {"/**"})}}, plain), 1U);
}

TEST(SideDoors, HiddenNodesAndActionsAreSpelledOut) {
  const std::vector<Interface> hidden = {
      {kService, "/_daemon/get_parameters", kGet},
      {kTopic, kParameterEvents, kParameterEventType, {}, "/_daemon"},
      {kService, "/_fib/_action/cancel_goal", kCancel, kFibonacci},
      {kService, "/_reset", kSetBool}};
  const int all = kServices | kActions | kParameters;
  EXPECT_EQ(opened(Policy{{rule(all, {"/**"})}}, hidden), 0U);
  EXPECT_EQ(opened(Policy{{rule(all, {"/_*"})}}, hidden), 4U);
}

TEST(Rights, ADenyWinsForAllKinds) {
  const auto opened_beside = [](std::string_view denied, const std::vector<Interface>& all) {
    auto open = rule(kTopics | kServices | kActions | kParameters, {"/**"});
    Rule closed;
    closed.name = "closed";
    closed.deny = patterns({denied});
    const auto behind = opened(Policy{{open, closed}}, all);
    EXPECT_EQ(opened(Policy{{closed, open}}, all), behind);
    return behind;
  };
  EXPECT_EQ(opened_beside("/other/**", parts()), 5U);
  EXPECT_EQ(opened_beside("/nav/**", parts()), 0U);
  EXPECT_EQ(opened_beside("/nav/fib", parts()), 0U);
  EXPECT_EQ(opened_beside("/nav/fib/**", parts()), 0U);
  // An action is whole or not at all.
  EXPECT_EQ(opened_beside("/nav/fib/_action/status", parts()), 0U);
  EXPECT_EQ(opened_beside("/**/cancel_goal", parts()), 0U);
  EXPECT_EQ(opened_beside("/nav/*", parameters()), 0U);
  EXPECT_EQ(opened_beside("/nav/node/**", parameters()), 1U);  // the events are not below the node
  EXPECT_EQ(opened_beside(kParameterEvents, parameters()), 6U);
  // What may be read need not be writable.
  EXPECT_EQ(opened_beside("/**/set_parameters*", parameters()), 5U);
  EXPECT_EQ(opened_beside("/nav/reset", {{kService, "/nav/reset", kSetBool}}), 0U);
}

TEST(Rights, DirectionsOfServicesAndActionsAreApart) {
  Rule robot;
  robot.name = "robot";
  robot.opens[Direction::kExport][OpenedBy::kServices] = patterns({"/out"});
  robot.opens[Direction::kImport][OpenedBy::kServices] = patterns({"/in"});
  robot.opens[Direction::kExport][OpenedBy::kActions] = patterns({"/nav/fib"});
  const Policy policy({robot});
  EXPECT_EQ(decided(policy, kExport, {kService, "/out", kSetBool}), "robot");
  EXPECT_EQ(decided(policy, kImport, {kService, "/out", kSetBool}), "denied");
  EXPECT_EQ(decided(policy, kImport, {kService, "/in", kSetBool}), "robot");
  EXPECT_EQ(decided(policy, kExport, {kService, "/in", kSetBool}), "denied");
  for (const auto& part : parts()) {
    EXPECT_EQ(decided(policy, kExport, part), "robot");
    EXPECT_EQ(decided(policy, kImport, part), "denied");
    EXPECT_FALSE(PeerAccepts(policy.accepts(kOperator)).takes(part));
  }
}

TEST(Rights, TypesAreThoseOfTheActionAndNotOfItsParts) {
  auto typed = rule(kActions | kServices | kParameters, {"/**"});
  typed.types = {kFibonacci};
  EXPECT_EQ(opened(Policy{{typed}}, parts()), 5U);
  EXPECT_EQ(opened(Policy{{typed}}, {{kService, "/nav/reset", kSetBool}}), 0U);
  EXPECT_EQ(opened(Policy{{typed}}, parameters()), 7U);  // a node has no type
  typed.types = {kCancel, kStatus, "p/action/Fibonacci_SendGoal"};
  EXPECT_EQ(opened(Policy{{typed}}, parts()), 0U);
}

TEST(Rights, IdentitiesNarrowAllKinds) {
  auto ops = rule(kServices | kActions | kParameters, {"/**"});
  ops.groups = {"ops"};
  const Policy policy({ops});
  auto all = parts();
  for (const auto& what : parameters()) all.push_back(what);
  all.push_back({kService, "/nav/reset", kSetBool});
  for (const auto& what : all) {
    EXPECT_EQ(decided(policy, kExport, what, kOperator), "r");
    EXPECT_EQ(decided(policy, kExport, what, kNobody), "denied");
    EXPECT_FALSE(PeerAccepts(policy.accepts(kNobody)).takes(what));
  }
  EXPECT_TRUE(events(policy, kExport, kOperator));
  EXPECT_FALSE(events(policy, kExport, kNobody));
}

TEST(Rights, TheFirstRuleThatOpensTheActionOrNodeTreatsAllOfIt) {
  auto first = rule(kActions | kParameters, {"/nav/**"});
  first.name = "first";
  first.treatment.call_timeout = std::chrono::seconds(5);
  auto second = rule(kTopics | kServices | kActions | kParameters, {"/**"});
  second.name = "second";
  const Policy policy({first, second});
  for (const auto& what : parts()) EXPECT_EQ(decided(policy, kExport, what), "first");
  for (const auto& what : parameters()) EXPECT_EQ(decided(policy, kExport, what), "first");
  EXPECT_EQ(decided(policy, kExport, {kService, "/nav/reset", kSetBool}), "second");
  const auto whole =
      policy.decide(kExport, InterfaceKind::kAction, "/nav/fib", kFibonacci, kOperator);
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->treatment, first.treatment);
  const auto decision = events(policy, kExport, kOperator);
  ASSERT_TRUE(decision);
  EXPECT_EQ(decision->rule, "first");
}

TEST(Rights, ParametersHaveADirection) {
  Rule out;
  out.opens[Direction::kExport][OpenedBy::kParameters] = patterns({"/**"});
  const Policy policy({out});
  for (const auto& what : parameters()) {
    EXPECT_TRUE(policy.decide(kExport, what, kOperator));
    EXPECT_FALSE(policy.decide(kImport, what, kOperator));
  }
  EXPECT_TRUE(events(policy, kExport, kOperator));
  EXPECT_FALSE(events(policy, kImport, kOperator));
  EXPECT_TRUE(policy.accepts(kOperator).rules.empty());
}

// A peer could offer anything under that name otherwise: no pattern for topics is asked.
TEST(Rights, ParameterEventsHaveTheirOwnTypeOnly) {
  const Policy policy({rule(kTopics | kParameters, {"/**"})});
  EXPECT_TRUE(policy.decide_parameter_events(kExport, kParameterEventType, kOperator));
  EXPECT_FALSE(policy.decide_parameter_events(kExport, "p/msg/T", kOperator));
}

TEST(Rights, ParameterEventsAsAWholeCanBeDenied) {
  EXPECT_FALSE(events(Policy{}, kExport, kOperator));
  EXPECT_FALSE(events(Policy{{rule(kTopics, {"/**"})}}, kExport, kOperator));
  auto open = rule(kParameters, {"/nav/node"});
  EXPECT_TRUE(events(Policy{{open}}, kExport, kOperator));
  Rule closed;
  closed.deny = patterns({"/parameter_*"});
  EXPECT_FALSE(events(Policy{{open, closed}}, kExport, kOperator));
}

TEST(Accepts, IsWhatThisIdentityMayOffer) {
  Rule drive;
  drive.opens[Direction::kImport][OpenedBy::kTopics] = patterns({"/cmd_vel", "/joy"});
  drive.types = {kTwist};
  drive.groups = {"ops"};
  Rule out;
  out.opens[Direction::kExport][OpenedBy::kTopics] = patterns({"/tf"});
  out.opens[Direction::kExport][OpenedBy::kServices] = patterns({"/reset"});
  out.opens[Direction::kExport][OpenedBy::kActions] = patterns({"/fib"});
  out.deny = patterns({"/secret/**"});
  Rule calls;
  calls.opens[Direction::kImport][OpenedBy::kServices] = patterns({"/s"});
  calls.opens[Direction::kImport][OpenedBy::kActions] = patterns({"/a"});
  calls.opens[Direction::kImport][OpenedBy::kParameters] = patterns({"/n", "/m/*"});
  const Policy policy({drive, out, calls});
  const auto accepts = policy.accepts(kOperator);
  using Strings = std::vector<std::string>;
  ASSERT_EQ(accepts.rules.size(), 2U);
  EXPECT_EQ(accepts.rules[0].topics, (Strings{"/cmd_vel", "/joy"}));
  EXPECT_EQ(accepts.rules[0].types, Strings{kTwist});
  EXPECT_EQ(accepts.rules[1].services, Strings{"/s"});
  EXPECT_EQ(accepts.rules[1].actions, Strings{"/a"});
  EXPECT_EQ(accepts.rules[1].parameters, (Strings{"/n", "/m/*"}));
  EXPECT_TRUE(accepts.rules[1].topics.empty());
  EXPECT_EQ(accepts.deny, Strings{"/secret/**"});
  EXPECT_EQ(policy.accepts(kNobody).rules.size(), 1U);
  EXPECT_EQ(policy.accepts(kNobody).deny.size(), 1U);
}

TEST(Accepts, WhatIsAcceptedIsWhatWouldBeAllowed) {
  Rule typed;
  typed.opens[Direction::kImport][OpenedBy::kTopics] = patterns({"/cmd_*", "/_x"});
  typed.opens[Direction::kImport][OpenedBy::kServices] = patterns({"/cmd_*"});
  typed.opens[Direction::kImport][OpenedBy::kActions] = patterns({"/robot/fib"});
  typed.types = {kTwist, kSetBool, kFibonacci};
  Rule wide;
  wide.opens[Direction::kImport][OpenedBy::kTopics] = patterns({"/robot/**"});
  wide.opens[Direction::kImport][OpenedBy::kServices] = patterns({"/robot/**"});
  wide.opens[Direction::kImport][OpenedBy::kActions] = patterns({"/robot/**"});
  wide.opens[Direction::kImport][OpenedBy::kParameters] = patterns({"/robot/*"});
  wide.deny = patterns({"/robot/secret/**", "/cmd_raw", "/robot/quiet/set_*"});
  const Policy policy({typed, wide});
  const PeerAccepts accepts(policy.accepts(kOperator));
  int allowed = 0;
  for (const auto* name :
       {"/cmd_vel", "/cmd_raw", "/_x", "/robot/a", "/robot/_a", "/robot/secret/a", "/robot", "bad",
        "/robot//a", "/robot/fib/_action/status", "/robot/fib/_action/send_goal",
        "/robot/secret/fib/_action/send_goal", "/robot/node/get_parameters",
        "/robot/quiet/set_parameters", "/robot/quiet/get_parameters", "/parameter_events"}) {
    for (const auto* type : {kTwist, "std_msgs/msg/String", kSetBool, "p/action/Fibonacci_SendGoal",
                             kStatus, kGet, kSet, "rcl_interfaces/msg/ParameterEvent"}) {
      for (const auto* action_type : {"", kFibonacci, "p/action/Other"}) {
        for (const auto* node : {"", "/robot/node", "/robot/secret/node"}) {
          for (const auto kind : {kTopic, kService}) {
            const Interface what{kind, name, type, action_type, node};
            const bool allows = policy.decide(kImport, what, kOperator).has_value();
            EXPECT_EQ(accepts.takes(what), allows) << name << " " << type << " " << node;
            allowed += allows ? 1 : 0;
          }
        }
      }
    }
  }
  EXPECT_GT(allowed, 50);
}

TEST(Accepts, TextsOfAPeerThatAreNoPatternsMatchNothing) {
  Accepts told;
  told.rules.push_back({{"", "/", "tf", "/t**", std::string(3000, '*'), "//tf"}, {}});
  told.rules.push_back({{}, {}, {"tf", "**"}, {"nav/fib"}, {"nav/*"}});
  const Interface tf{kTopic, "/tf", kTwist};
  const PeerAccepts nothing(told);
  EXPECT_FALSE(nothing.takes(tf));
  for (const auto& what : parts()) EXPECT_FALSE(nothing.takes(what));
  for (const auto& what : parameters()) EXPECT_FALSE(nothing.takes(what));
  told.rules.push_back({{"/tf"}, {}});
  told.deny = {"/tf/", "", "**"};
  EXPECT_TRUE(PeerAccepts(told).takes(tf));
}

}  // namespace
}  // namespace connect_bridge::policy_test
