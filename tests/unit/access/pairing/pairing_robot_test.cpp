#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "access/login/token_file.hpp"
#include "access/pairing/invitation_text.hpp"
#include "access/pairing/pairing_folder.hpp"
#include "config/config.hpp"
#include "config/explain_right.hpp"
#include "unit/access/pairing/pairing_start.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

// The robot dials, and its rules are there: by them an operator may look, or operate it.
TEST_F(PairingStart, ARobotThatDialsSaysWhatItsOperatorMayDo) {
  const Start server = serve({"--pair", "--drive", "desk.local"});
  EXPECT_THAT(server.problems, IsEmpty());
  const Parsed desk = parse_config(server.parameters, Role::kServer, {});
  ASSERT_THAT(desk.problems, IsEmpty());
  EXPECT_FALSE(desk.config->is_robot());
  EXPECT_TRUE(desk.config->default_rules);
  EXPECT_EQ(server.keep(), "");
  EXPECT_EQ(serve({}).parameters, server.parameters);
  const std::string line = to_text(*server.invitation);
  EXPECT_THAT(invitation_text(*server.invitation, 9090),
              HasSubstr("client --robot 'wss+pair://desk.local:9090/#"));

  for (const bool operates : {false, true}) {
    const Start robot = operates ? join({"--robot", "--operate", line}) : join({"--robot", line});
    ASSERT_THAT(robot.problems, IsEmpty());
    EXPECT_THAT(robot.news.back(), HasSubstr(operates ? "set parameters" : "nothing"));
    const Parsed parsed = parse_config(robot.parameters, Role::kClient, {});
    ASSERT_THAT(parsed.problems, IsEmpty());
    EXPECT_TRUE(parsed.config->is_robot());
    RightQuestion question;
    const auto allows = [&](OpenedBy what, const char* name, Direction direction) {
      question = {what, name, {}, direction, {}};
      return explain_right(*parsed.config, question).allowed;
    };
    EXPECT_TRUE(allows(OpenedBy::kTopics, "/scan", Direction::kExport));
    EXPECT_FALSE(allows(OpenedBy::kTopics, "/rosout", Direction::kExport));
    EXPECT_FALSE(allows(OpenedBy::kTopics, "/rosout", Direction::kImport));
    for (const OpenedBy what : {OpenedBy::kServices, OpenedBy::kActions, OpenedBy::kParameters}) {
      EXPECT_EQ(allows(what, "/a", Direction::kExport), operates);
      EXPECT_FALSE(allows(what, "/a", Direction::kImport));
    }
    EXPECT_EQ(allows(OpenedBy::kTopics, "/cmd_vel", Direction::kImport), operates);
  }

  // What its owner changes stays, and one more word opens nothing by itself.
  const Start first = join({"--robot", line});
  EXPECT_EQ(first.joining->keep(), "");
  EXPECT_EQ(join({}).parameters, first.parameters);
  EXPECT_EQ(join({"--robot", line}).parameters, first.parameters);
  EXPECT_THAT(join({"--robot", "--operate", line}).problems,
              ElementsAre(HasSubstr("has paired already, without --operate")));
}

TEST_F(PairingStart, TwoOfAKindAreRefused) {
  const std::string for_robot = kLine + std::string{".robot"};
  EXPECT_THAT(join({for_robot}).problems, ElementsAre(HasSubstr("with client --robot")));
  EXPECT_THAT(join({"--robot", kLine}).problems, ElementsAre(HasSubstr("leave out --robot")));
  // A folder stays what it was.
  ASSERT_EQ(join({kLine}).joining->keep(), "");
  EXPECT_THAT(join({"--robot", for_robot}).problems,
              ElementsAre(HasSubstr("is one where the robot is the server: give this one a name")));
  ASSERT_EQ(serve({"--pair", "--drive"}).keep(), "");
  EXPECT_THAT(serve({"--pair"}).problems,
              ElementsAre(HasSubstr("is one where the robot is the client: give this one a name")));
  EXPECT_THAT(serve({"--pair"}, {{"robot", std::string{"client"}}}).problems,
              ElementsAre(HasSubstr("--drive says which end is the robot")));
}

// Else its names would be those of the first.
TEST_F(PairingStart, ASecondRobotNeedsNamesByIdentity) {
  ASSERT_EQ(serve({"--pair", "--drive"}).keep(), "");
  EXPECT_THAT(serve({"--pair", "--drive"}).problems, IsEmpty());  // nobody has paired yet
  TokenEntry robot;
  robot.identity = "robot1";
  ASSERT_EQ(append_token_entry(PairingFolder("/connect_server").file("tokens.yaml"), robot), "");
  EXPECT_THAT(serve({"--pair", "--drive"}).problems,
              ElementsAre(HasSubstr("this server has a robot already")));
  EXPECT_EQ(robot_end({}, {}, "/connect_server"), Role::kClient);
  ASSERT_EQ(serve({"--pair", "--drive"}, {{"prefix", std::string{"by_identity"}}}).keep(), "");
  EXPECT_THAT(serve({"--pair", "--drive"}).problems, IsEmpty());
  const Start second = start_with({{"prefix", std::string{"/robot2"}}},
                                  read_arguments({"--pair", "--drive"}, Role::kServer), "/robot2");
  EXPECT_EQ(second.keep(), "");
  EXPECT_EQ(start_with({}, {}, "/robot2").parameters, second.parameters);
}

TEST_F(PairingStart, ADriversServerIsReachedByARelayToo) {
  const Start first = serve({"--pair", "--drive", "--via", kRelayLine});
  ASSERT_THAT(first.problems, IsEmpty());
  const Start robot = join({"--robot", to_text(*first.invitation)});
  EXPECT_THAT(robot.problems, IsEmpty());
  const Parsed parsed = parse_config(robot.parameters, Role::kClient, {});
  ASSERT_THAT(parsed.problems, IsEmpty());
  EXPECT_EQ(parsed.config->dial.url.robot, "robot7");
}

}  // namespace
}  // namespace connect_bridge
