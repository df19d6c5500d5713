// The service ~/drive of an operator's side.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "core/base/cdr.hpp"
#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

using testing::HasSubstr;

// An operator with a stick on /cmd_vel. The service is mirror 1 of a service; the robot on
// connection 1 demands channel 1.
struct Operator : Script {
  explicit Operator(bool demands = true) : Script(options()) {
    Topic stick = topic("/cmd_vel").pub(1);
    stick.type = "geometry_msgs/msg/Twist";
    graph({stick, topic("/picture").pub(2)});
    join(1);
    if (demands) demand(1, 1);
    said(1);
    did();
  }
  static SideOptions options() {
    SideOptions result = server();
    result.drive_switch = true;
    return result;
  }
  void call(std::uint32_t request, bool take) {
    give(RequestTaken{{1}, {request}, CdrWriter().u8(take ? 1 : 0).take()});
  }
  void tell(WheelState state) { say(1, Wheel{{1}, state}); }
  // "1 true: text", one line for each answer.
  std::string answers() {
    std::string lines;
    while (const auto action = side.next_action()) {
      if (const auto* drop = std::get_if<DropRequest>(&*action))
        lines += std::to_string(drop->request.value) + " dropped\n";
      const auto* response = std::get_if<SendResponse>(&*action);
      if (response == nullptr) continue;
      CdrReader reader(response->payload.view());
      const bool success = reader.u8() == 1;
      lines += std::to_string(response->request.value) + (success ? " true: " : " false: ") +
               std::string(reader.string().value_or("?")) + "\n";
    }
    return lines;
  }
};

TEST(DriveSwitch, ItIsAServiceThatOtherBridgesDoNotExport) {
  Script s(Operator::options());
  s.graph({});
  const std::string done = s.did();
  const auto claimed = done.find("claim [");
  EXPECT_NE(claimed, std::string::npos);
  EXPECT_GT(done.find("mirror_service 1 /own/drive\n"), claimed);
  EXPECT_NE(done.find("mirror_service 1 /own/drive\n"), std::string::npos);
}

TEST(DriveSwitch, ARobotHasNone) {
  Script s(server());
  s.graph({});
  EXPECT_EQ(s.did().find("/own/drive"), std::string::npos);
}

TEST(DriveSwitch, NoMirrorHasItsName) {
  Rule calls = callable();
  auto options = Operator::options();
  options.policy = Policy({calls});
  Script s(options);
  s.graph({});
  s.join(1);
  s.pass(2000);
  s.say(1, Offer{{service_channel(1, "/own/drive"), service_channel(2, "/own/other")}, true});
  EXPECT_EQ(s.said(1), "attach 2 1\n");
}

TEST(DriveSwitch, ItIsAnsweredWhenTheRobotHasTold) {
  Operator s;
  s.call(7, true);
  EXPECT_EQ(s.said(1), "wheel 1 want take\n");
  EXPECT_EQ(s.answers(), "");
  s.tell(WheelState::kYours);
  EXPECT_EQ(s.answers(), "7 true: you drive /cmd_vel\n");
  s.call(8, false);
  EXPECT_EQ(s.said(1), "wheel 1 want leave\n");
  EXPECT_EQ(s.answers(), "");
  s.tell(WheelState::kFree);
  EXPECT_EQ(s.answers(), "8 true: nobody drives /cmd_vel\n");
}

// Its robot may then tell the last state alone, which says nothing about the first call.
TEST(DriveSwitch, TheOppositeEndsACallThatWaits) {
  Operator s;
  s.call(7, true);
  EXPECT_EQ(s.answers(), "");
  s.tell(WheelState::kTaken);
  s.call(8, false);
  EXPECT_EQ(s.answers(),
            "7 false: another call has asked for the opposite since\n"
            "8 true: another peer drives /cmd_vel\n");
  s.pass(2000);
  EXPECT_EQ(s.answers(), "");
}

TEST(DriveSwitch, ARobotThatTellsNothingIsNamedLater) {
  Operator s;
  s.call(7, true);
  s.pass(1999);
  EXPECT_EQ(s.answers(), "");
  s.pass(1);
  EXPECT_EQ(s.answers(),
            "7 false: nobody drives /cmd_vel: its robot has not answered, or has no wheel\n");
}

TEST(DriveSwitch, AnotherPeerOrAHeldStickIsTheReason) {
  Operator s;
  s.tell(WheelState::kTaken);
  s.call(7, false);
  EXPECT_EQ(s.answers(), "7 true: another peer drives /cmd_vel\n");
  s.call(8, true);
  s.tell(WheelState::kHalted);
  s.pass(2000);
  EXPECT_EQ(s.answers(), "8 false: nobody drives /cmd_vel: let go first\n");
}

TEST(DriveSwitch, WithoutACommandThereIsNothingToSteer) {
  Operator s(false);
  s.call(7, true);
  EXPECT_EQ(s.said(1), "");
  EXPECT_THAT(s.answers(), HasSubstr("7 false: nothing to steer"));
  s.demand(1, 1);
  s.call(8, true);
  s.lose(1);
  s.pass(2000);
  EXPECT_THAT(s.answers(), HasSubstr("8 false: nothing to steer"));
}

TEST(DriveSwitch, CallsThatWaitAreBounded) {
  Operator s;
  for (std::uint32_t i = 1; i <= 17; ++i) s.call(i, true);
  EXPECT_EQ(s.answers(), "17 false: too many calls wait\n");
}

// With a request that is no SetBool nothing is taken.
TEST(DriveSwitch, ARequestWithoutContentIsDropped) {
  Operator s;
  s.give(RequestTaken{{1}, {7}, sample("")});
  EXPECT_EQ(s.said(1), "");
  EXPECT_EQ(s.answers(), "7 dropped\n");
}

TEST(DriveSwitch, WithoutItsTypeItIsNotThere) {
  Operator s;
  s.give(ServiceMirrorFailed{{1}, "type_unknown", "std_srvs is not installed", ""});
  s.did();
  EXPECT_THAT(s.logged, HasSubstr("there is no service /own/drive: std_srvs is not installed"));
}

}  // namespace
}  // namespace connect_bridge::side_test
