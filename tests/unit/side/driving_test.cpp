// What drives a robot, at the robot's side: the hooks of core/driving.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <utility>

#include "unit/driving/samples.hpp"
#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

using driving_test::twist;
using driving_test::twist_stamped;
using std::chrono::milliseconds;
using testing::HasSubstr;

Rule driving(Duration halt_after = milliseconds(300), Duration max_age = kForever) {
  Rule all = everything();
  all.treatment.halt_after = halt_after;
  all.treatment.max_age = max_age;
  return all;
}

// A robot, whose base subscribes to /cmd_vel; anna and bob drive it on links 1 and 2 as publishers
// 7 and 8.
struct Robot : Script {
  explicit Robot(const Rule& rule = driving(), bool stamped = false, bool at_robot = true)
      : Script(options(rule, at_robot)),
        type(stamped ? "geometry_msgs/msg/TwistStamped" : "geometry_msgs/msg/Twist") {
    see({});
    pass(1000);
    for (const std::uint32_t link : {1U, 2U}) {
      login(link, {}, called(link == 1 ? "anna" : "bob"));
      offer(link, static_cast<std::uint8_t>(6 + link));
    }
    did();
  }
  static SideOptions options(const Rule& rule, bool at_robot) {
    auto result = server({rule});
    result.at_robot = at_robot;
    result.audits = true;
    return result;
  }
  void see(std::vector<Topic> others) {
    Topic driven = topic("/cmd_vel").sub(5);
    driven.type = type;
    others.push_back(driven);
    graph(others);
  }
  void offer(std::uint32_t link, std::uint8_t publisher) {
    ChannelOffer offered = channel(1, "/cmd_vel", {origin(1, publisher)});
    offered.type = type;
    say(link, Offer{{offered}, true});
    said(link);
  }
  // A reply measures that the peer's clock is ahead by this.
  void tell_clock(std::uint32_t link, std::int64_t ahead_ms = 0, bool is_possible = true) {
    give(TimePassed{});  // it asks, or has asked lately
    const Stamp ahead = ahead_ms * 1'000'000;
    for (std::int64_t asked = std::max<std::int64_t>(0, at - 1200); asked <= at; ++asked) {
      const Stamp then = flow_test::at_ms(asked);
      Bytes reply;
      const Stamp sent = is_possible ? flow_test::at_ms(at) : then - 1;
      append_header(TimeReply{then, then + ahead, sent + ahead, 0}, reply);
      binary(link, reply);
    }
  }
  void command(std::uint32_t link, const Payload& body, std::int64_t stamp_ms) {
    message(link, 1, 1, body, Codec::kNone, static_cast<std::uint32_t>(body.size()), stamp_ms,
            ++numbers[link]);
  }
  void move(std::uint32_t link) { command(link, twist(0.5), at); }
  void stop(std::uint32_t link) { command(link, twist(0), at); }

  // What is published for the robot, and lines of the audit log about it.
  std::string drove() {
    std::string words;
    while (const auto action = side.next_action()) {
      std::string word;
      if (const auto* made = std::get_if<Publish>(&*action))
        word = shown(made->payload);
      else if (const auto* line = std::get_if<Audit>(&*action))
        word = line->event >= AuditEvent::kWheelTaken ? word_of(*line) : "";
      else if (std::holds_alternative<DestroyMirror>(*action))
        word = "unmirror";
      else if (const auto* log = std::get_if<Log>(&*action))
        logged += log->text + "\n";
      if (!word.empty()) words += (words.empty() ? "" : "; ") + word;
    }
    return words;
  }
  std::string shown(const Payload& payload) {
    const auto steers = *driving::command_type(type);
    const auto command = driving::read_command(steers, payload.view());
    if (!command.readable) return "";  // a claim
    last = driving_test::bytes_of(payload);
    return command.moves ? "move" : "zero";
  }
  std::uint64_t lost(std::size_t link, DropReason reason) const {
    return status().links.at(link).topics.at(0).dropped.of(reason);
  }

  std::string type;
  std::map<std::uint32_t, std::uint64_t> numbers;  // of the last command, by link
  Bytes last;                                      // of the last command that was published
};

TEST(Driving, SilenceHaltsWhoDrives) {
  Robot s;
  s.tell_clock(1);
  s.drove();
  s.move(1);
  EXPECT_EQ(s.drove(), "wheel_taken 1 anna import /cmd_vel by rule moved; move");
  s.pass(299);
  EXPECT_EQ(s.drove(), "");
  s.pass(1);
  EXPECT_EQ(s.drove(),
            "zero; halted 1 anna import /cmd_vel by rule silence: 1 commands, the oldest 0 ms old");
  s.pass(200);
  EXPECT_EQ(s.drove(), "zero; zero");
  ++s.numbers[1];  // the stick is held, and a command was lost
  s.move(1);
  EXPECT_EQ(s.drove(), "");
  EXPECT_EQ(s.lost(0, DropReason::kWheel), 1U);
  EXPECT_THAT(s.logged, HasSubstr("has to let go first"));
  s.stop(1);
  s.pass(10);
  s.move(1);
  EXPECT_THAT(s.drove(), HasSubstr("zero; move"));
}

// Whatever name a login gives, it is one.
TEST(Driving, TheAuditLogNamesWhoDrives) {
  Robot s;
  s.login(3, {}, called("side door"));
  s.offer(3, 9);
  s.tell_clock(3);
  s.drove();
  s.move(3);
  EXPECT_EQ(s.drove(), "wheel_taken 3 side door import /cmd_vel by rule moved; move");
}

// A clock that is set neither stops the robot nor lets it drive on.
TEST(Driving, AHaltDoesNotComeByTheSystemsClock) {
  for (const Stamp hour : {3600 * kStampSecond, -3600 * kStampSecond}) {
    Robot s;
    s.tell_clock(1);
    s.move(1);
    s.pass(100);
    s.move(1);
    s.drove();
    const auto wait = [&](std::int64_t ms) {
      s.at += ms;
      Now now = flow_test::now_ms(s.at);
      now.system += hour;
      s.side.handle(TimePassed{}, now);
      return s.drove();
    };
    EXPECT_EQ(wait(200), "");
    EXPECT_EQ(wait(99), "");
    EXPECT_THAT(wait(1), HasSubstr("zero; halted 1 anna import /cmd_vel by rule silence"));
  }
}

TEST(Driving, OneDrivesAtATime) {
  Robot s;
  s.tell_clock(1);
  s.tell_clock(2);
  s.drove();
  s.move(1);
  s.drove();
  s.pass(100);
  s.move(2);
  EXPECT_EQ(s.drove(), "");
  EXPECT_EQ(s.lost(1, DropReason::kWheel), 1U);
  EXPECT_THAT(s.logged, HasSubstr("another peer drives"));
  s.pass(1500);
  s.stop(2);
  EXPECT_THAT(s.drove(), HasSubstr("zero"));
  s.pass(10);
  s.move(2);
  EXPECT_THAT(s.drove(), HasSubstr("wheel_taken 2 bob"));
}

// The publisher's own end is only silence; its mirror lives until the halt is heard.
TEST(Driving, AMirrorPublishesTheHaltOfAPublisherThatHasEnded) {
  Robot s;
  s.tell_clock(1);
  s.move(1);
  s.drove();
  s.pass(100);
  s.say(1, OriginsChanged{{1}, {}, {{1}}});
  s.pass(199);
  EXPECT_EQ(s.drove(), "");
  s.pass(1);
  EXPECT_THAT(s.drove(), HasSubstr("zero; halted 1 anna"));
  s.pass(200);
  EXPECT_EQ(s.drove(), "zero; zero");
  s.pass(299);
  EXPECT_EQ(s.drove(), "");
  s.pass(400);
  EXPECT_THAT(s.drove(), HasSubstr("unmirror"));
}

TEST(Driving, TheEndOfALinkHaltsAtOnce) {
  Robot s(driving(milliseconds(5000)));
  s.tell_clock(1);
  s.move(1);
  s.drove();
  s.lose(1, 1000);  // it leaves for good
  EXPECT_EQ(s.drove(),
            "zero; halted 1 anna import /cmd_vel by rule link_lost: 1 commands, the oldest 0 ms "
            "old; wheel_left 1 anna import /cmd_vel by rule link_lost: 1 commands, the oldest 0 ms "
            "old");
  s.pass(499);
  EXPECT_EQ(s.drove(), "zero; zero");
  s.pass(1);
  EXPECT_EQ(s.drove(), "unmirror");
}

TEST(Driving, TheEndOfARightHaltsAtOnce) {
  Robot s(driving(milliseconds(5000)));
  s.tell_clock(1);
  s.move(1);
  s.drove();
  s.give(PolicyChanged{Policy({rule({}, {"/other"})})});
  EXPECT_THAT(s.drove(), HasSubstr("zero; halted 1 anna import /cmd_vel by rule right"));
  s.pass(499);
  EXPECT_THAT(s.drove(), HasSubstr("zero; zero"));
  s.pass(1);
  EXPECT_EQ(s.drove(), "unmirror");
}

TEST(Driving, ASideThatStopsHaltsFirst) {
  Robot s;
  s.tell_clock(1);
  s.move(1);
  s.drove();
  s.give(StopRequested{});
  EXPECT_THAT(s.drove(), HasSubstr("zero; halted"));
}

TEST(Driving, WithoutAWheelOrARobotAllMove) {
  Rule plain = driving();
  plain.treatment.wheel = false;
  Rule idle = driving();
  idle.treatment.drives = false;
  for (const auto& [rule, at_robot] :
       {std::pair{plain, true}, std::pair{idle, true}, std::pair{driving(), false}}) {
    Robot s(rule, false, at_robot);
    s.tell_clock(1);
    s.tell_clock(2);
    s.drove();
    s.move(1);
    s.move(2);
    EXPECT_EQ(s.drove(), "move; move");
    s.pass(500);
    EXPECT_EQ(s.drove(), "");
  }
}

TEST(Driving, ARuleThatLosesItsWheelHaltsNobody) {
  for (const bool drives : {true, false}) {
    Robot s;
    s.tell_clock(1);
    s.move(1);
    s.drove();
    Rule plain = driving();
    plain.treatment.wheel = !drives;
    plain.treatment.drives = drives;
    s.give(PolicyChanged{Policy({plain})});
    s.pass(500);
    EXPECT_EQ(s.drove(),
              "wheel_left 1 anna import /cmd_vel by rule right: 1 commands, the oldest 0 ms old");
  }
}

// Its candidate waits for the link's return.
TEST(Driving, TheEndOfALostLinksRightHaltsAtOnce) {
  Robot s(driving(milliseconds(5000)));
  s.tell_clock(1);
  s.move(1);
  s.lose(1);
  s.drove();
  s.give(PolicyChanged{Policy({rule({}, {"/other"})})});
  EXPECT_THAT(s.drove(), HasSubstr("zero; halted 1 anna import /cmd_vel by rule right"));
}

// Link 3 is another way to the publisher of link 1.
TEST(Driving, WhoGoesOnByAnotherWayIsHaltedWhenThatEndsToo) {
  Robot s(driving(milliseconds(5000)));
  s.login(3, {}, called("anne"));
  s.offer(3, 7);
  s.tell_clock(1);
  s.move(1);
  EXPECT_THAT(s.drove(), HasSubstr("wheel_taken 1 anna"));
  s.lose(1, 1000);
  EXPECT_EQ(s.drove(), "");
  s.lose(3, 1000);
  EXPECT_THAT(s.drove(), HasSubstr("zero; halted 3 anna import /cmd_vel by rule link_lost"));
}

// Nobody else's topics take a robot's wheel away.
TEST(Driving, EachTopicHasAWheel) {
  constexpr std::uint32_t kTopics = 300;
  Robot s;
  std::vector<Topic> heard;
  std::vector<ChannelOffer> offered;
  for (std::uint32_t n = 2; n < 2 + kTopics; ++n) {
    const std::string name = "/r" + std::to_string(n) + "/cmd_vel";
    heard.push_back(topic(name).sub(5));
    heard.back().type = s.type;
    offered.push_back(channel(n, name, {origin(1, 7)}));
    offered.back().type = s.type;
  }
  s.see(heard);
  s.say(1, Offer{offered, true});
  s.pass(60'000);
  s.said(1);
  s.tell_clock(1);
  s.drove();
  const Payload body = twist(1);
  for (std::uint32_t n = 2; n < 2 + kTopics; ++n)
    s.message(1, n, 1, body, Codec::kNone, static_cast<std::uint32_t>(body.size()), s.at);
  std::size_t taken = 0;
  for (std::string words = s.drove(); const char c : words) taken += c == ';';
  EXPECT_EQ(taken, 2 * kTopics - 1);
}

TEST(Driving, AnotherPublisherOfTheHolderDrivesAfterTheFirstOneHasEnded) {
  Robot s;
  s.say(1, OriginsChanged{{1}, {origin(2, 9)}, {}});
  s.tell_clock(1);
  s.move(1);
  s.drove();
  const Payload body = twist(1);
  const auto say_by_other = [&] {
    s.pass(50);
    s.message(1, 1, 2, body, Codec::kNone, static_cast<std::uint32_t>(body.size()), s.at);
    return s.drove();
  };
  EXPECT_EQ(say_by_other(), "");
  EXPECT_THAT(s.logged, HasSubstr("another publisher of the same operator drives"));
  s.say(1, OriginsChanged{{1}, {}, {{1}}});
  EXPECT_EQ(say_by_other(), "move");
}

// Its mirror was about to end.
TEST(Driving, AMirrorThatIsHaltedLatePublishesAllZeros) {
  Robot s(driving(kForever));
  s.tell_clock(1);
  s.tell_clock(2);
  s.move(1);
  s.drove();
  s.say(1, OriginsChanged{{1}, {}, {{1}}});
  s.pass(150);
  s.stop(2);
  EXPECT_THAT(s.drove(), HasSubstr("zero; halted 1 anna import /cmd_vel by rule stopped"));
  s.pass(160);
  EXPECT_EQ(s.drove(), "zero; zero");
  s.pass(339);
  EXPECT_EQ(s.drove().find("unmirror"), std::string::npos);
  s.pass(1);
  EXPECT_THAT(s.drove(), HasSubstr("unmirror"));
}

// ---- age

TEST(Driving, ACommandWithoutAKnownAgeWaitsForTheFirstReply) {
  Robot s(driving(kForever, milliseconds(300)));
  s.command(1, twist(1), s.at + 4990);
  s.command(1, twist(2), s.at + 4995);
  EXPECT_EQ(s.drove(), "");
  EXPECT_EQ(s.lost(0, DropReason::kMaxAge), 1U);  // the newest one waits
  s.tell_clock(1, 5000);
  EXPECT_THAT(s.drove(), HasSubstr("wheel_taken 1 anna"));
  EXPECT_EQ(s.last, driving_test::bytes_of(twist(2)));
}

TEST(Driving, ACommandWhoseAgeStaysUnknownMovesNothing) {
  Robot s(driving(kForever, milliseconds(300)));
  s.move(1);
  s.pass(299);
  EXPECT_EQ(s.lost(0, DropReason::kMaxAge), 0U);
  s.pass(1);
  EXPECT_EQ(s.lost(0, DropReason::kMaxAge), 1U);
  s.tell_clock(1);
  EXPECT_EQ(s.drove(), "");
}

TEST(Driving, AReplyThatMeasuresNothingEndsNoWait) {
  Robot s(driving(kForever, milliseconds(5000)));
  s.move(1);
  s.tell_clock(1, 0, false);
  EXPECT_EQ(s.drove(), "");
  s.pass(1100);
  s.tell_clock(1);
  EXPECT_THAT(s.drove(), HasSubstr("move"));
}

// The command that waits is over then.
TEST(Driving, AStopDoesNotWaitForTheFirstReply) {
  Robot s(driving(kForever, milliseconds(300)));
  s.move(1);
  s.stop(1);
  EXPECT_EQ(s.drove(), "zero");
  EXPECT_EQ(s.lost(0, DropReason::kMaxAge), 1U);
  s.tell_clock(1);
  EXPECT_EQ(s.drove(), "");
}

TEST(Driving, AStopThatSeemsToComeFromTheFutureStops) {
  Robot s(driving(kForever, milliseconds(300)));
  s.tell_clock(1);
  s.move(1);
  s.drove();
  s.command(1, twist(0), s.at + 5000);
  EXPECT_EQ(s.drove(), "zero");
  s.command(1, twist(0), s.at - 301);
  EXPECT_EQ(s.drove(), "");
}

TEST(Driving, HaltAfterIsTheMaxAgeToo) {
  Robot s;
  s.tell_clock(1);
  s.drove();
  s.command(1, twist(1), s.at - 301);
  EXPECT_EQ(s.drove(), "");
  EXPECT_EQ(s.lost(0, DropReason::kMaxAge), 1U);
  s.command(1, twist(1), s.at - 300);
  EXPECT_THAT(s.drove(), HasSubstr("move"));
}

TEST(Driving, OldCommandsAreNoSignOfLife) {
  Robot s;
  s.tell_clock(1);
  s.move(1);
  s.drove();
  for (int i = 0; i < 6; ++i) {
    s.pass(50);
    s.command(1, twist(1), s.at - 400 + i);
  }
  EXPECT_THAT(s.drove(), HasSubstr("zero; halted 1 anna import /cmd_vel by rule age"));
}

TEST(Driving, APublisherWhoseClockIsAheadOfItsBridgeDrives) {
  Robot s(driving(kForever, milliseconds(300)));
  s.tell_clock(1);
  s.drove();
  s.command(1, twist(1), s.at + 5000);
  EXPECT_EQ(s.drove(), "");
  s.pass(1100);
  s.tell_clock(1);
  s.drove();
  s.command(1, twist(1), s.at + 5000);
  EXPECT_THAT(s.drove(), HasSubstr("move"));
  EXPECT_THAT(s.logged, HasSubstr("5000 ms ahead of its bridge's"));
  s.command(1, twist(1), s.at + 4600);
  EXPECT_EQ(s.drove(), "");
}

// ---- stamps

std::int64_t stamp_ms_of(const Robot& s) {
  const auto command = driving::read_command(driving::CommandType::kTwistStamped, s.last);
  return (*driving::stamp_of(s.last, command.stamp) - flow_test::at_ms(0)) / 1'000'000;
}

TEST(Driving, AStampIsInTheRobotsClock) {
  Robot s(driving(kForever), true);
  s.tell_clock(1, 5000);
  s.drove();
  s.command(1, twist_stamped(flow_test::at_ms(s.at + 4980), 1), s.at + 4985);
  EXPECT_THAT(s.drove(), HasSubstr("move"));
  EXPECT_EQ(stamp_ms_of(s), s.at - 20);
}

TEST(Driving, AStampStaysWithSimulatedTime) {
  Robot s(driving(kForever), true);
  Topic clock = topic("/clock").pub(9);
  clock.type = "rosgraph_msgs/msg/Clock";
  s.see({clock});
  s.tell_clock(1, 5000);
  s.drove();
  s.command(1, twist_stamped(flow_test::at_ms(s.at + 4980), 1), s.at + 4985);
  EXPECT_THAT(s.drove(), HasSubstr("move"));
  EXPECT_EQ(stamp_ms_of(s), s.at + 4980);
}

TEST(Driving, AZeroHasTheRobotsTime) {
  Robot s(driving(), true);
  s.tell_clock(1, 5000);
  s.command(1, twist_stamped(flow_test::at_ms(s.at + 4980), 1), s.at + 4985);
  s.drove();
  s.pass(300);
  EXPECT_THAT(s.drove(), HasSubstr("zero"));
  EXPECT_EQ(stamp_ms_of(s), s.at);
}

}  // namespace
}  // namespace connect_bridge::side_test
