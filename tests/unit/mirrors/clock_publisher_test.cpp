#include "core/mirrors/clock_publisher.hpp"

#include <gtest/gtest.h>

#include "unit/flow/script.hpp"

namespace connect_bridge {
namespace {

using flow_test::at_ms;
using flow_test::now_ms;

// Time in milliseconds; the clock is published every 10 ms.
struct ClockScript {
  ClockScript() { clock.start("/clock", outputs, now_ms(0)); }

  // A reply says that the peer's ROS time is `ros` at `at`; the round trip took 20 ms.
  void reply(std::int64_t at, std::int64_t ros) {
    clock.on_reply({at_ms(at - 10), at_ms(at), at_ms(at), ros * 1'000'000}, at_ms(at + 10));
  }
  // What was published up to then, in milliseconds.
  std::vector<std::int64_t> pass(std::int64_t until) {
    while (*clock.deadline() <= now_ms(until).steady) {
      const auto at = (*clock.deadline() - TimePoint{}) / std::chrono::milliseconds(1);
      clock.on_time(outputs, claims, now_ms(at));
    }
    std::vector<std::int64_t> published;
    while (const auto action = outputs.next())
      if (const auto* p = std::get_if<Publish>(&*action)) published.push_back(ms_of(p->payload));
    return published;
  }
  static std::int64_t ms_of(const Payload& payload) {
    const auto v = payload.view();
    EXPECT_EQ(v.size(), 12U);
    std::int64_t words[2] = {};
    for (std::size_t i = 0; i < 8; ++i) words[i / 4] |= std::int64_t{v[4 + i]} << (8 * (i % 4));
    return words[0] * 1000 + words[1] / 1'000'000;
  }

  Outputs outputs;
  Claims claims{Token128{{5}}};
  ClockPublisher clock{std::chrono::milliseconds(10)};
};

using Times = std::vector<std::int64_t>;

// The time of one would be a little before that of the other, and step back.
TEST(ClockPublisher, OfTwoBridgesTheSmallerSideIdPublishes) {
  ClockScript s, other;
  s.reply(0, 1000);
  EXPECT_EQ(s.pass(10), (Times{1000, 1010}));
  Claim claim{Token128{{4}}, {}};
  other.clock.add_mirrored(claim);
  s.claims.update({}, claim, TimePoint{});
  EXPECT_EQ(s.pass(30), Times{});
  claim.side = {{6}};  // it is the one to be silent
  s.claims.update({}, {Token128{{4}}, {}}, TimePoint{});
  s.claims.update({}, claim, TimePoint{});
  EXPECT_EQ(s.pass(40), Times{1040});
}

TEST(ClockPublisher, AClaimSaysThatItIsThere) {
  ClockScript s;
  EXPECT_EQ(s.outputs.take_follow_up(FollowUp::kClaim), FollowUp::kClaim);
  EXPECT_EQ(s.outputs.take_follow_up(FollowUp::kClaim), std::nullopt);
  s.clock.stop(s.outputs);
  EXPECT_EQ(s.outputs.take_follow_up(FollowUp::kClaim), FollowUp::kClaim);
  Claim claim;
  s.clock.add_mirrored(claim);
  EXPECT_TRUE(claim.services.empty());
}

TEST(ClockPublisher, ItsMirrorComesAndGoes) {
  Outputs outputs;
  ClockPublisher clock(std::chrono::milliseconds(10));
  EXPECT_FALSE(clock.deadline());
  clock.start("/robot/clock", outputs, now_ms(7));
  clock.start("/robot/clock", outputs, now_ms(8));  // already there
  const auto created = std::get<CreateMirror>(outputs.next().value());
  EXPECT_EQ(created.topic, "/robot/clock");
  EXPECT_EQ(created.type, "rosgraph_msgs/msg/Clock");
  EXPECT_EQ(created.qos.reliability, Reliability::kReliable);  // serves best effort, too
  EXPECT_EQ(created.qos.depth, 10U);
  EXPECT_EQ(clock.deadline(), now_ms(7).steady);
  clock.stop(outputs);
  EXPECT_EQ(std::get<DestroyMirror>(outputs.next().value()).id, created.id);
  EXPECT_FALSE(clock.deadline());
  clock.stop(outputs);
  EXPECT_FALSE(outputs.next());
}

TEST(ClockPublisher, NothingIsSaidBeforeThePeerWasHeard) {
  ClockScript script;
  EXPECT_EQ(script.pass(500), Times{});
}

TEST(ClockPublisher, APeerWithoutRosTimeIsNotHeard) {
  ClockScript script;
  script.reply(10, 0);
  EXPECT_EQ(script.pass(500), Times{});
}

TEST(ClockPublisher, GoesOnBetweenTheRepliesAtTheirRate) {
  ClockScript script;
  script.reply(100, 5000);
  EXPECT_EQ(script.pass(109), (Times{5000, 5000, 5000, 5000, 5000, 5000, 5000, 5000, 5000, 5000,
                                     5000}));  // until 100 it is only known what comes
  script.reply(200, 5050);                     // half speed
  script.pass(199);
  EXPECT_EQ(script.pass(240), (Times{5050, 5055, 5060, 5065, 5070}));
}

TEST(ClockPublisher, AStandingPeerStands) {
  ClockScript script;
  script.reply(0, 5000);
  script.reply(100, 5100);
  script.reply(200, 5100);  // paused
  script.pass(209);
  EXPECT_EQ(script.pass(300), Times(10, 5100));
  script.reply(300, 5100);
  EXPECT_EQ(script.pass(350), Times(5, 5100));
}

// It is paused between two replies: what was said before the second one was known stands, too, and
// is passed again when the peer's time goes on.
TEST(ClockPublisher, APauseThatIsHeardOfLateStands) {
  ClockScript script;
  script.reply(0, 5000);
  script.reply(100, 5100);
  script.pass(210);         // no further ahead than until a reply comes
  script.reply(200, 5150);  // paused since 150
  script.reply(300, 5150);
  EXPECT_EQ(script.pass(1000), Times(79, 5210));
  for (int at = 1100; at <= 1400; at += 100) {
    script.reply(at, 5150 + at - 1000);
    script.pass(at + 10);
  }
  const auto published = script.pass(1500);
  EXPECT_TRUE(std::is_sorted(published.begin(), published.end()));
  EXPECT_EQ(published.back(), 5650);
}

TEST(ClockPublisher, NeverRunsBackwards) {
  ClockScript script;
  script.reply(0, 5000);
  script.reply(100, 5100);
  script.pass(190);
  EXPECT_EQ(script.pass(210), (Times{5200, 5210}));
  script.reply(200, 5150);  // it slowed down: we are ahead
  const auto published = script.pass(400);
  EXPECT_EQ(published.front(), 5210);
  EXPECT_TRUE(std::is_sorted(published.begin(), published.end()));
  EXPECT_EQ(published.back(), 5250);  // half speed
}

TEST(ClockPublisher, ARestartedSimulationIsFollowedBackwards) {
  ClockScript script;
  script.reply(0, 90'000);
  script.reply(100, 90'100);
  script.pass(190);
  script.reply(200, 50);
  EXPECT_EQ(script.pass(220), (Times{50, 60, 70}));  // at the speed known before
}

TEST(ClockPublisher, AJumpForwardIsNoSpeed) {
  for (const std::int64_t jump : {500, 5'000, 3'600'000}) {
    SCOPED_TRACE(jump);
    ClockScript script;
    script.reply(0, 10'000);
    script.reply(100, 10'100);
    script.pass(190);
    script.reply(200, 10'200 + jump);
    EXPECT_EQ(script.pass(220), (Times{10'200 + jump, 10'210 + jump, 10'220 + jump}));
    script.pass(290);
    script.reply(300, 10'300 + jump);
    EXPECT_EQ(script.pass(310), (Times{10'300 + jump, 10'310 + jump}));
  }
}

TEST(ClockPublisher, AHigherSpeedIsFollowed) {
  ClockScript script;
  script.reply(0, 10'000);
  script.reply(100, 10'100);
  script.reply(200, 11'100);
  script.reply(300, 12'100);
  script.pass(299);
  EXPECT_EQ(script.pass(320), (Times{12'100, 12'200, 12'300}));
}

TEST(ClockPublisher, RepliesCloseToEachOtherTellNoSpeed) {
  ClockScript script;
  script.reply(0, 10'000);
  script.reply(100, 10'100);
  script.reply(110, 10'190);
  script.pass(109);
  EXPECT_EQ(script.pass(120), (Times{10'190, 10'200}));
}

TEST(ClockPublisher, ImpossibleStampsAreIgnored) {
  ClockScript script;
  script.clock.on_reply({at_ms(0), 0, 0, Stamp{1} << 62}, at_ms(1));
  script.clock.on_reply({at_ms(0), 0, 0, -5}, at_ms(1));
  script.clock.on_reply({0, 0, 0, 5'000'000}, at_ms(1));
  script.clock.on_reply({at_ms(2), 0, 0, 5'000'000}, at_ms(1));  // came before it was asked for
  EXPECT_EQ(script.pass(100), Times{});
}

TEST(ClockPublisher, AHeldUpLoopPublishesOnceAndGoesOn) {
  ClockScript script;
  script.reply(0, 5000);
  script.pass(0);
  script.clock.on_time(script.outputs, script.claims, now_ms(500));
  EXPECT_EQ(script.pass(500), (Times{5500, 5500}));
  EXPECT_EQ(script.clock.deadline(), now_ms(510).steady);
}

}  // namespace
}  // namespace connect_bridge
