// The ROS time of one graph as the time of the other.
#include <gtest/gtest.h>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

TEST(SideClock, ThePeersClockIsPublishedWhereTheRuleSaysSo) {
  auto options = client();
  options.clock_publish_period = std::chrono::milliseconds(10);
  options.names = NameMap("/robot", {});
  Script s(options);
  s.give(TimePassed{});
  s.did();
  s.be_welcomed(1);
  const int told = service_gid("time on /robot/clock").bytes[0];  // to other bridges
  EXPECT_EQ(s.did(), "gate 1\nmirror 2 /robot/clock reliable volatile 10\nclaim [" +
                         std::to_string(told) + "]\n");
  s.lose(1, 4008);
  s.pass(2900);
  EXPECT_EQ(s.did().find("unmirror"), std::string::npos);
  s.pass(200);
  EXPECT_NE(s.did().find("unmirror 2\n"), std::string::npos);
}

// A server may have several peers: one of those that the rule is for gives the time, and another
// one when its link is dead.
TEST(SideClock, OfSeveralPeersOneGivesTheTime) {
  auto options = server();
  options.clock_publish_period = std::chrono::milliseconds(10);
  options.clock_groups = {"robots"};
  Script s(options);
  s.give(TimePassed{});
  s.did();
  const auto mirrored = [&] { return s.did().find("mirror ") != std::string::npos; };
  Identity who{"viewer", {}};
  s.login(1, {}, who);
  EXPECT_FALSE(mirrored());
  who = {"robot1", {"robots"}};
  s.login(2, {}, who);
  EXPECT_TRUE(mirrored());
  who.name = "robot2";
  s.login(3, {}, who);
  EXPECT_FALSE(mirrored());
  s.lose(3, 4008);
  s.pass(3100);
  EXPECT_FALSE(mirrored());
  s.login(4, {}, who);
  s.lose(2, 4008);
  s.pass(3100);
  EXPECT_NE(s.did().find("unmirror 2\nmirror 3 /clock"), std::string::npos);
}

// Who may give it no more gives it no more, and another one does.
TEST(SideClock, WithItsRightThePeersTimeEnds) {
  auto options = server();
  options.clock_publish_period = std::chrono::milliseconds(10);
  options.clock_groups = {"robots"};
  Script s(options);
  s.give(TimePassed{});
  Identity robot{"robot1", {"robots"}};
  robot.credential = "token:1";
  s.login(1, {}, robot);
  Identity other{"robot2", {"robots"}};
  s.login(2, {}, other);
  s.did();
  robot.groups.clear();
  s.give(IdentitiesChanged{{{robot.credential, robot}}});
  EXPECT_NE(s.did().find("unmirror 2\nmirror 3 /clock"), std::string::npos);
}

// Its graph's /clock is followed while a peer publishes its time and may have that topic.
TEST(SideClock, ItsClockIsFollowedForAPeerThatPublishesIt) {
  Script s(server({rule({"/clock"}, {})}));
  Topic clock = topic("/clock");
  clock.type = kClockType;
  s.join(1);
  s.did();
  Accepts accepts;
  accepts.ros_time = true;
  s.say(1, accepts);
  EXPECT_EQ(s.did(), "clock followed\n");
  // The simulator starts after the link, and again: the system's time must never be told.
  s.graph({clock.pub(1)});
  s.graph({});
  s.graph({clock});
  EXPECT_EQ(s.did(), "");
  s.give(PolicyChanged{Policy({rule({"/odom"}, {})})});
  EXPECT_EQ(s.did(), "clock not followed\n");
  s.give(PolicyChanged{Policy({rule({"/clock"}, {})})});
  s.lose(1);
  EXPECT_EQ(s.did(), "clock followed\nclock not followed\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
