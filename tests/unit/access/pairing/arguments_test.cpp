#include "access/pairing/arguments.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;

constexpr char kGivenLine[] = "wss+pair://robot.local:9090/#00112233445566778899aabbccddeeff.47";

TEST(Arguments, OthersAreRefusedWithoutTheirValue) {
  const Arguments read = read_arguments({"--pair", "--x", "auth.token:=secret"}, Role::kServer);
  EXPECT_TRUE(read.pairs);
  EXPECT_EQ(read.host, "");
  EXPECT_THAT(read.problems, ElementsAre(HasSubstr("\"--x\""), HasSubstr("\"auth.token\"")));
  EXPECT_EQ(read_arguments({"--pair", "robot.example"}, Role::kServer).host, "robot.example");
  EXPECT_TRUE(read_arguments({"--pair", "--operate"}, Role::kServer).operates);
  EXPECT_THAT(read_arguments({"--operate"}, Role::kServer).problems,
              ElementsAre(HasSubstr("add --pair")));
  EXPECT_THAT(read_arguments({"--pair"}, Role::kClient).problems, SizeIs(1));
  EXPECT_THAT(read_arguments({kGivenLine}, Role::kServer).problems, SizeIs(1));
}

TEST(Arguments, OfTheUnknownItSaysWhatWasMeant) {
  const auto told = [](const char* word, Role role) {
    const auto problems = read_arguments({word}, role).problems;
    return problems.size() == 1 ? problems.front() : "";
  };
  EXPECT_THAT(told("--pare", Role::kServer), HasSubstr("did you mean --pair? See server --help"));
  EXPECT_THAT(told("--operat", Role::kClient), HasSubstr("did you mean --operate?"));
  EXPECT_THAT(told("--pair", Role::kClient), Not(HasSubstr("did you mean")));
  EXPECT_THAT(told("wss://robot:9090", Role::kClient),
              HasSubstr("did you mean --ros-args -p url:=wss://robot:9090?"));
  EXPECT_THAT(told("wss://robot:9090", Role::kServer), Not(HasSubstr("did you mean")));
  EXPECT_THAT(told("robot.yaml", Role::kServer),
              HasSubstr("did you mean --ros-args --params-file robot.yaml?"));
  EXPECT_THAT(
      told("auth.token:=secret", Role::kServer),
      AllOf(HasSubstr("did you mean --ros-args -p auth.token:=...?"), Not(HasSubstr("secret"))));
  EXPECT_THAT(told("--wombat", Role::kServer), HasSubstr("parameters are given behind --ros-args"));
}

// Who owns the robot says what may be done there.
TEST(Arguments, WhichEndIsTheRobotAndWhoSaysWhatItDoes) {
  const auto problems = [](const std::vector<std::string>& words, Role role) {
    return read_arguments(words, role).problems;
  };
  EXPECT_EQ(read_arguments({"--pair"}, Role::kServer).robot, Role::kServer);
  EXPECT_EQ(read_arguments({"--pair", "--drive"}, Role::kServer).robot, Role::kClient);
  EXPECT_EQ(read_arguments({"--robot", kGivenLine}, Role::kClient).robot, Role::kClient);
  EXPECT_TRUE(read_arguments({"--robot", "--operate", kGivenLine}, Role::kClient).operates);
  EXPECT_THAT(problems({"--pair", "--drive", "--operate"}, Role::kServer),
              ElementsAre(HasSubstr("belongs to the robot's end")));
  EXPECT_THAT(problems({"--drive"}, Role::kServer), ElementsAre(HasSubstr("add --pair")));
  EXPECT_THAT(problems({"--robot"}, Role::kClient), ElementsAre(HasSubstr("the invitation")));
  EXPECT_THAT(problems({"--operate", kGivenLine}, Role::kClient),
              ElementsAre(HasSubstr("belongs to the robot's end")));
  EXPECT_THAT(problems({"--via", "wss+relay://robot7@relay.example/#a", kGivenLine}, Role::kClient),
              ElementsAre(HasSubstr("--via is for the end that listens")));
  EXPECT_THAT(problems({"--robot", kGivenLine}, Role::kServer),
              ElementsAre(HasSubstr("\"--robot\""), HasSubstr("robot.local:9090/\"")));
  EXPECT_THAT(problems({"--drive", kGivenLine}, Role::kClient), SizeIs(1));
}

}  // namespace
}  // namespace connect_bridge
