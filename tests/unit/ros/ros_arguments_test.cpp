#include "ros/parameters/ros_arguments.hpp"

#include <gtest/gtest.h>

namespace connect_bridge::ros {
namespace {

template <std::size_t N>
std::vector<std::string> problems(const char* const (&argv)[N]) {
  return problems_of_remaps(static_cast<int>(N), argv);
}

TEST(RosArguments, AreShownWithoutTheirValues) {
  for (const char* argument : {"auth.token", "auth.token:=secret", "auth.token=secret",
                               "auth.token:secret", "auth.token: secret", "auth.token secret"})
    EXPECT_EQ(without_value(argument), "auth.token") << argument;
}

TEST(Remaps, OfTheNodeItselfAreFine) {
  EXPECT_TRUE(problems({"client"}).empty());
  EXPECT_TRUE(problems({"client", "--ros-args", "-r", "__node:=robot1", "--remap", "__ns:=/fleet",
                        "-r", "connect_client:__name:=robot2", "--", "-r", "/a:=/b"})
                  .empty());
}

TEST(Remaps, OfTopicsAreRefused) {
  const auto found = problems({"client", "--ros-args", "-r", "/cmd_vel:=/joy_vel", "--remap",
                               "connect_client:/a:=/b", "-r", "__node:=x", "-r"});
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0],
            "the remap /cmd_vel:=/joy_vel: what crosses is renamed by the parameters remap and "
            "prefix, not by -r");
  EXPECT_NE(found[1].find("connect_client:/a:=/b"), std::string::npos);
}

}  // namespace
}  // namespace connect_bridge::ros
