#include "core/policy/interface.hpp"

#include <gtest/gtest.h>

#include "unit/policy/words.hpp"

namespace connect_bridge::policy_test {
namespace {

// "kActions /fib p/action/Fibonacci"
std::string opened(const Interface& what) {
  const auto opening = opening_of(what);
  constexpr const char* kWords[] = {"nothing", "topics", "services", "actions", "parameters"};
  std::string text = kWords[static_cast<int>(opening.by)];
  if (opening.by == OpenedBy::kNothing) return text;
  text += " " + std::string{opening.name};
  return opening.type.empty() ? text : text + " " + std::string{opening.type};
}

TEST(Interface, AnActionHasFivePartsAndEachIsRecognised) {
  const std::pair<const char*, const char*> kParts[] = {
      {"/a/fib/_action/send_goal", "p/action/Fibonacci_SendGoal"},
      {"/a/fib/_action/cancel_goal", kCancel},
      {"/a/fib/_action/get_result", "p/action/Fibonacci_GetResult"},
      {"/a/fib/_action/feedback", "p/action/Fibonacci_FeedbackMessage"},
      {"/a/fib/_action/status", kStatus}};
  for (const auto part : kActionParts) {
    const auto& [name, type] = kParts[static_cast<std::size_t>(part)];
    EXPECT_EQ(name_of_part("/a/fib", part), name);
    EXPECT_EQ(type_of_part(kFibonacci, part), type);
    const auto found = part_of_action(kind_of(part), name, type);
    ASSERT_TRUE(found) << name;
    EXPECT_EQ(found->action, "/a/fib");
    EXPECT_EQ(found->part, part);
    EXPECT_EQ(opened({kind_of(part), name, type, kFibonacci}), "actions /a/fib p/action/Fibonacci");
    // Of the other kind there is no such part.
    const auto other = kind_of(part) == kTopic ? kService : kTopic;
    EXPECT_FALSE(part_of_action(other, name, type));
    EXPECT_EQ(opened({other, name, type, kFibonacci}), "nothing");
  }
}

TEST(Interface, TheTypeOfAnActionIsThatOfItsPartOrIsTold) {
  const auto told = [](const char* type) -> std::string {
    const auto part = part_of_action(kService, "/f/_action/send_goal", type);
    return part ? std::string{part->action_type} : "no part";
  };
  EXPECT_EQ(told("p/action/Fibonacci_SendGoal"), kFibonacci);
  for (const auto* type :
       {"p/action/_SendGoal", "p/action/Fibonacci_GetResult", "p/action/SendGoal",
        "p/srv/Fibonacci_SendGoal", "p/action/Fibonacci", kCancel, "", "x"}) {
    EXPECT_EQ(told(type), "no part") << type;
  }
  const Interface send{kService, "/f/_action/send_goal", "p/action/Fibonacci_SendGoal"};
  EXPECT_EQ(opened(send), "actions /f p/action/Fibonacci");
  auto wrong = send;
  wrong.action_type = "p/action/Other";
  EXPECT_EQ(opened(wrong), "nothing");
  // These two are the same for every action: the offer has to say of which action they are.
  for (Interface what : {Interface{kService, "/f/_action/cancel_goal", kCancel},
                         Interface{kTopic, "/f/_action/status", kStatus}}) {
    EXPECT_EQ(opened(what), "nothing");
    for (const auto* type : {"p/srv/Fibonacci", "Fibonacci", "p/action/", "std_msgs/msg/String"}) {
      what.action_type = type;
      EXPECT_EQ(opened(what), "nothing") << type;
    }
    what.action_type = kFibonacci;
    EXPECT_EQ(opened(what), "actions /f p/action/Fibonacci");
    what.type = "std_srvs/srv/SetBool";
    EXPECT_EQ(opened(what), "nothing");
  }
}

TEST(Interface, OtherNamesWithTheTokenOfActionsAreNothing) {
  for (const auto* name :
       {"/_action/send_goal", "/f/_action/send_goal/x", "/f/_action/other", "/f/_action",
        "/f/_action/_action/send_goal", "/a/_action/b/_action/send_goal", "/_action",
        "/f/_action/send_goals", "/f/_action/get_parameters", "/f/_action/x/get_parameters"}) {
    EXPECT_TRUE(has_action_token(name)) << name;
    for (const auto* type : {"p/action/Fibonacci_SendGoal", "std_srvs/srv/SetBool",
                             "rcl_interfaces/srv/GetParameters", "std_msgs/msg/String"}) {
      EXPECT_EQ(opened({kService, name, type, kFibonacci, "/n"}), "nothing") << name << " " << type;
      EXPECT_EQ(opened({kTopic, name, type, kFibonacci, "/n"}), "nothing") << name << " " << type;
    }
  }
  EXPECT_FALSE(has_action_token("/f/my_action/x"));
  EXPECT_FALSE(has_action_token("/f/_actions"));
  EXPECT_EQ(opened({kService, "/f/_actions/send_goal", "std_srvs/srv/SetBool"}),
            "services /f/_actions/send_goal std_srvs/srv/SetBool");
}

TEST(Interface, ParameterServicesBelongToTheirNode) {
  const std::pair<const char*, const char*> kServices[] = {
      {"describe_parameters", "rcl_interfaces/srv/DescribeParameters"},
      {"get_parameter_types", "rcl_interfaces/srv/GetParameterTypes"},
      {"get_parameters", "rcl_interfaces/srv/GetParameters"},
      {"list_parameters", "rcl_interfaces/srv/ListParameters"},
      {"set_parameters", "rcl_interfaces/srv/SetParameters"},
      {"set_parameters_atomically", "rcl_interfaces/srv/SetParametersAtomically"}};
  for (const auto& [token, type] : kServices) {
    const std::string name = std::string{"/a/node/"} + token;
    EXPECT_EQ(opened({kService, name, type}), "parameters /a/node");
    EXPECT_EQ(node_of_parameter_service(name, type), "/a/node");
    // Neither as parameters nor as services.
    EXPECT_EQ(opened({kService, name, "std_srvs/srv/SetBool"}), "nothing");
    EXPECT_EQ(opened({kService, std::string{"/"} + token, type}), "nothing");
    EXPECT_EQ(opened({kTopic, name, "std_msgs/msg/String"}),
              "topics " + name + " std_msgs/msg/String");
  }
  EXPECT_EQ(opened({kService, "/a/get_parameters", "rcl_interfaces/srv/SetParameters"}), "nothing");
  EXPECT_EQ(opened({kService, "/a/my_get_parameters", "std_srvs/srv/SetBool"}),
            "services /a/my_get_parameters std_srvs/srv/SetBool");
}

TEST(Interface, ParameterEventsBelongToTheNodeOfTheirOrigin) {
  const std::string type{kParameterEventType};
  EXPECT_EQ(opened({kTopic, kParameterEvents, type, {}, "/a/node"}), "parameters /a/node");
  for (const auto* node : {"", "node", "/", "/a//b", "/a/_action/b", "/*"}) {
    EXPECT_EQ(opened({kTopic, kParameterEvents, type, {}, node}), "nothing") << node;
  }
  EXPECT_EQ(opened({kTopic, kParameterEvents, "std_msgs/msg/String", {}, "/a/node"}), "nothing");
  EXPECT_EQ(opened({kTopic, "/a/parameter_events", type, {}, "/a/node"}),
            "topics /a/parameter_events rcl_interfaces/msg/ParameterEvent");
}

TEST(Interface, WhatIsNotAsItShouldBeIsOpenedByNothing) {
  EXPECT_EQ(opened({InterfaceKind::kAction, "/f", kFibonacci}), "nothing");
  EXPECT_EQ(opened({InterfaceKind::kOther, "/f", "std_msgs/msg/String"}), "nothing");
  EXPECT_EQ(opened({kTopic, "/f/", "std_msgs/msg/String"}), "nothing");
  EXPECT_EQ(opened({kTopic, "/f", "std_srvs/srv/SetBool"}), "nothing");
  EXPECT_EQ(opened({kService, "/f", "std_msgs/msg/String"}), "nothing");
  EXPECT_EQ(opened({kTopic, "/f", ""}), "nothing");
}

TEST(Interface, TypesOfTopicsServicesAndActions) {
  const auto which = [](std::string_view type) {
    std::string text;
    if (is_topic_type(type)) text += 't';
    if (is_service_type(type)) text += 's';
    if (is_action_type(type)) text += 'a';
    return text;
  };
  EXPECT_EQ(which("std_msgs/msg/String"), "t");
  EXPECT_EQ(which("std_srvs/srv/SetBool"), "s");
  EXPECT_EQ(which("std_srvs/srv/SetBool_Event"), "ts");
  EXPECT_EQ(which("p/action/Fibonacci"), "a");
  EXPECT_EQ(which("p/action/Fibonacci_SendGoal"), "sa");
  EXPECT_EQ(which("p/action/Fibonacci_GetResult"), "sa");
  EXPECT_EQ(which("p/action/Fibonacci_FeedbackMessage"), "ta");
  for (const auto* type : {"", "/", "a/b", "a/b/C", "/srv/T", "p/srv/", "p/action/_SendGoal_",
                           "p/srv/A/B", "p/srv/\xc3\xa4", "p srv T"}) {
    EXPECT_EQ(which(type), "") << type;
  }
}

TEST(DefaultPriority, TheClassesOfWellKnownTopics) {
  EXPECT_EQ(default_priority("/clock", "rosgraph_msgs/msg/Clock"), Priority::kUrgent);
  EXPECT_EQ(default_priority("/tf", "tf2_msgs/msg/TFMessage"), Priority::kHigh);
  EXPECT_EQ(default_priority("/robot1/tf_static", "tf2_msgs/msg/TFMessage"), Priority::kHigh);
  EXPECT_EQ(default_priority("/joint_states", "sensor_msgs/msg/JointState"), Priority::kHigh);
  EXPECT_EQ(default_priority("/camera/image", "sensor_msgs/msg/Image"), Priority::kBulk);
  EXPECT_EQ(default_priority("/map", "nav_msgs/msg/OccupancyGrid"), Priority::kBulk);
  EXPECT_EQ(default_priority("/cmd_vel", "geometry_msgs/msg/Twist"), Priority::kUrgent);
  EXPECT_EQ(default_priority("/image", "std_msgs/msg/String"), Priority::kNormal);
}

TEST(Commands, AreKnownByTypeOrName) {
  EXPECT_TRUE(drives({}, "/teleop", "geometry_msgs/msg/TwistStamped"));
  EXPECT_TRUE(
      drives({}, "/arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory"));
  EXPECT_TRUE(drives({}, "/robot1/goal_pose", "geometry_msgs/msg/PoseStamped"));
  EXPECT_TRUE(drives({}, "/goal_pose", "geometry_msgs/msg/PoseStamped"));
  EXPECT_FALSE(drives({}, "/pose", "geometry_msgs/msg/PoseStamped"));
  EXPECT_FALSE(drives({}, "/goal_pose/history", "nav_msgs/msg/Path"));
  EXPECT_FALSE(resumes({}, "/goal_pose", "geometry_msgs/msg/PoseStamped"));
  EXPECT_TRUE(resumes({}, "/pose", "geometry_msgs/msg/PoseStamped"));
  Treatment kept;
  kept.resume = true;
  EXPECT_FALSE(resumes({}, "/camera", "sensor_msgs/msg/CompressedImage"));
  EXPECT_TRUE(resumes(kept, "/camera", "sensor_msgs/msg/CompressedImage"));
  EXPECT_TRUE(resumes({}, "/points", "sensor_msgs/msg/PointCloud2"));
  EXPECT_TRUE(resumes(kept, "/goal_pose", "geometry_msgs/msg/PoseStamped"));
}

TEST(DefaultPriority, TheStatusOfActionsIsHighAndFeedbackIsNot) {
  EXPECT_EQ(default_priority("/f/_action/feedback", "p/action/Fibonacci_FeedbackMessage"),
            Priority::kNormal);
  EXPECT_EQ(default_priority("/f/_action/status", kStatus), Priority::kHigh);
}

}  // namespace
}  // namespace connect_bridge::policy_test
