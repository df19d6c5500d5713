// Whether only the newest message counts, or each one.
#include "core/policy/treatment.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

Keep kept(std::string_view type, const TopicTraits& traits = {}) {
  return keep_of({}, type, traits).keep;
}

TopicTraits with_header() {
  TopicTraits traits;
  traits.has_header = true;
  return traits;
}

TEST(KeepOf, AStateIsReplaced) {
  TopicTraits best_effort;
  best_effort.best_effort = true;
  EXPECT_EQ(kept("nav_msgs/msg/Odometry", with_header()), Keep::kNewest);
  EXPECT_EQ(kept("p/msg/Any", best_effort), Keep::kNewest);
  EXPECT_EQ(kept("geometry_msgs/msg/Twist"), Keep::kNewest);
  EXPECT_EQ(kept("tf2_msgs/msg/TFMessage"), Keep::kNewest);
}

TEST(KeepOf, AnEventIsNot) {
  EXPECT_EQ(kept("p/msg/DoorOpened"), Keep::kAll);
  for (const char* type :
       {"rcl_interfaces/msg/Log", "p/action/Move_FeedbackMessage",
        "map_msgs/msg/OccupancyGridUpdate", "nav2_msgs/msg/CostmapUpdate",
        "visualization_msgs/msg/MarkerArray", "can_msgs/msg/Frame",
        "foxglove_msgs/msg/CompressedVideo", "diagnostic_msgs/msg/DiagnosticArray"}) {
    TopicTraits traits = with_header();
    traits.best_effort = true;
    EXPECT_EQ(kept(type, traits), Keep::kAll) << type;
  }
}

TEST(KeepOf, WhatAPublisherKeepsForOthersCounts) {
  TopicTraits traits = with_header();
  traits.latched = 1;
  EXPECT_EQ(kept("nav_msgs/msg/OccupancyGrid", traits), Keep::kNewest);
  traits.latched = 2;
  EXPECT_EQ(kept("nav_msgs/msg/OccupancyGrid", traits), Keep::kAll);
  traits.latched = 0;
  traits.keep_all = true;
  EXPECT_EQ(kept("nav_msgs/msg/Odometry", traits), Keep::kAll);
}

TEST(KeepOf, TheRuleDecides) {
  Treatment treatment;
  treatment.keep = Keep::kNewest;
  EXPECT_EQ(keep_of(treatment, "rcl_interfaces/msg/Log", {}).keep, Keep::kNewest);
  treatment.keep = Keep::kAll;
  EXPECT_EQ(keep_of(treatment, "geometry_msgs/msg/Twist", with_header()).keep, Keep::kAll);
}

}  // namespace
}  // namespace connect_bridge
