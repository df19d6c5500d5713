// Words for tests of the rules.
#pragma once

#include <initializer_list>
#include <string_view>
#include <vector>

#include "core/policy/policy.hpp"

namespace connect_bridge::policy_test {

inline constexpr auto kExport = Direction::kExport;
inline constexpr auto kImport = Direction::kImport;
inline constexpr auto kTopic = InterfaceKind::kTopic;
inline constexpr auto kService = InterfaceKind::kService;
inline constexpr auto kAction = InterfaceKind::kAction;
inline constexpr auto kTwist = "geometry_msgs/msg/Twist";
inline constexpr auto kSetBool = "std_srvs/srv/SetBool";
inline constexpr auto kFibonacci = "p/action/Fibonacci";
inline constexpr auto kCancel = "action_msgs/srv/CancelGoal";
inline constexpr auto kStatus = "action_msgs/msg/GoalStatusArray";

inline const Identity kNobody;
inline const Identity kOperator{"anna", {"ops", "day"}, 0};

inline std::vector<Pattern> patterns(std::initializer_list<std::string_view> texts) {
  std::vector<Pattern> result;
  for (const auto text : texts) result.push_back(Pattern::parse(text).value());
  return result;
}

}  // namespace connect_bridge::policy_test
