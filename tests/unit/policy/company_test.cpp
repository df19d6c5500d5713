#include "core/policy/treatment.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

TEST(Company, ACameraInfoFollowsAndWhatIsBulkIsLarge) {
  EXPECT_EQ(company_of("/c/camera_info", "sensor_msgs/msg/CameraInfo", {}), Company::kFollows);
  EXPECT_EQ(company_of("/c/image", "sensor_msgs/msg/Image", {}), Company::kLarge);
  EXPECT_EQ(company_of("/odom", "nav_msgs/msg/Odometry", {}), Company::kNone);
  Treatment bulk;
  bulk.priority = Priority::kBulk;
  EXPECT_EQ(company_of("/own", "own_msgs/msg/Picture", bulk), Company::kLarge);
}

TEST(Company, ARuleDecidesButNotForWhatGoesFirst) {
  Treatment rule;
  rule.with_large = true;
  EXPECT_EQ(company_of("/odom", "nav_msgs/msg/Odometry", rule), Company::kFollows);
  EXPECT_EQ(company_of("/cmd", "geometry_msgs/msg/TwistStamped", rule), Company::kNone);
  EXPECT_EQ(company_of("/joints", "sensor_msgs/msg/JointState", rule), Company::kNone);
  rule.priority = Priority::kHigh;
  EXPECT_EQ(company_of("/odom", "nav_msgs/msg/Odometry", rule), Company::kNone);
  rule = {};
  rule.with_large = false;
  EXPECT_EQ(company_of("/c/camera_info", "sensor_msgs/msg/CameraInfo", rule), Company::kNone);
}

TEST(Company, TheFormsOfAnImageAreInItsNamespace) {
  const auto infos = company_namespace("/c/camera_info", Company::kFollows);
  EXPECT_EQ(company_namespace("/c/image_raw", Company::kLarge), infos);
  EXPECT_EQ(company_namespace("/c/image_raw/compressed", Company::kLarge), infos);
  EXPECT_NE(company_namespace("/d/image_raw", Company::kLarge), infos);
  EXPECT_NE(company_namespace("/c/image_raw/other", Company::kLarge), infos);
  EXPECT_EQ(company_namespace("/camera_info", Company::kFollows),
            company_namespace("/image", Company::kLarge));
}

TEST(Company, NodesAreToldApart) {
  EXPECT_EQ(company_node(""), 0U);
  EXPECT_NE(company_node("/left"), company_node("/right"));
}

}  // namespace
}  // namespace connect_bridge
