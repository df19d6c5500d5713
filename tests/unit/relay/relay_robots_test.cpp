#include <gmock/gmock.h>

#include "unit/relay/relay_bed.hpp"

namespace connect_bridge::test {
namespace {

using testing::ElementsAre;
using testing::StartsWith;

TEST(Relay, ARobotThatComesBackHearsOfWhoWaits) {
  AtRelay at;
  HandRobot before(at, "robot7", "robot7-token");
  ASSERT_TRUE(before.hears(1));
  RawPeer visitor(at.port());
  visitor.send(visitor_hello("robot7"));
  ASSERT_TRUE(before.hears(2));
  HandRobot other(at, "robot8", "robot8-token");
  ASSERT_TRUE(other.hears(1));
  HandRobot robot(at, "robot7", "robot7-token");
  ASSERT_TRUE(robot.hears(2));
  EXPECT_EQ(robot.said[1], before.said[1]);
  EXPECT_EQ(other.said.size(), 1U);
  RawPeer ticket(at.port());
  ticket.send(ticket_hello("robot7", robot.ticket(1)));
  EXPECT_TRUE(ticket.sees(at.loop, visitor_hello("robot7")));
}

// Else an operator drives one of two machines by chance.
TEST(Relay, OfTwoRobotsWithOneTokenTheOneThatAnswersStays) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token");
  ASSERT_TRUE(robot.hears(1));
  for (int i = 0; i < 3; ++i) {
    const std::size_t heard = robot.said.size();
    HandRobot copy(at, "robot7", "robot7-token");
    ASSERT_TRUE(robot.hears(heard + 1));
    EXPECT_EQ(robot.said.back(), "ping");
    EXPECT_THAT(copy.said, testing::IsEmpty());
    robot.lines->say("pong");
    ASSERT_TRUE(copy.hears(1));
    EXPECT_THAT(copy.said, ElementsAre("refused twin"));
    EXPECT_TRUE(at.loop.until([&] { return copy.ended; }));
  }
  EXPECT_FALSE(robot.ended);
  EXPECT_EQ(at.refused(RelayRefusal::kTwin), 3U);
  EXPECT_TRUE(at.relay->status().robots[0].twin);
  EXPECT_THAT(at.warnings,
              ElementsAre(testing::HasSubstr("two machines have the token of robot7")));
  // Nobody has asked.
  robot.lines->say("pong");
  EXPECT_TRUE(at.loop.until([&] { return robot.ended; }));
}

TEST(Relay, TheSameProcessComesBackAtOnce) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token", "", "one");
  ASSERT_TRUE(robot.hears(1));
  HandRobot copy(at, "robot7", "robot7-token", "", "two");
  ASSERT_TRUE(robot.hears(2));
  HandRobot again(at, "robot7", "robot7-token", "", "one");
  ASSERT_TRUE(again.hears(2));
  EXPECT_THAT(robot.said, ElementsAre("welcome clients", "ping"));
  EXPECT_TRUE(at.loop.until([&] { return robot.ended; }));
  EXPECT_THAT(again.said, ElementsAre("welcome clients", "ping"));
  again.lines->say("pong");
  ASSERT_TRUE(copy.hears(1));
  EXPECT_THAT(copy.said, ElementsAre("refused twin"));
}

// The path of the one that is here may be slow, and the process that answered may have dialled
// again.
TEST(Relay, ACopyThatWasRefusedWaitsLongerForAnAnswer) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token", "", "one");
  ASSERT_TRUE(robot.hears(1));
  HandRobot first(at, "robot7", "robot7-token", "", "two");
  ASSERT_TRUE(robot.hears(2));
  robot.lines->say("pong");
  ASSERT_TRUE(first.hears(1));
  HandRobot again(at, "robot7", "robot7-token", "", "one");
  ASSERT_TRUE(again.hears(1));
  HandRobot copy(at, "robot7", "robot7-token", "", "two");
  ASSERT_TRUE(again.hears(2));
  at.loop.run_for(600ms);  // twice as long as an unknown copy waits
  EXPECT_THAT(copy.said, testing::IsEmpty());
  again.lines->say("pong");
  ASSERT_TRUE(copy.hears(1));
  EXPECT_THAT(copy.said, ElementsAre("refused twin"));
  EXPECT_FALSE(again.ended);
}

TEST(Relay, ARobotThatAnswersManyCopiesStays) {
  AtRelay at(100);
  HandRobot robot(at, "robot7", "robot7-token");
  ASSERT_TRUE(robot.hears(1));
  for (std::size_t i = 0; i < kRobotLinesAtOnce + 5; ++i) {
    HandRobot copy(at, "robot7", "robot7-token");
    ASSERT_TRUE(robot.hears(i + 2));
    robot.lines->say("pong");
    ASSERT_TRUE(copy.hears(1));
    ASSERT_THAT(copy.said, ElementsAre("refused twin")) << i;
  }
  EXPECT_FALSE(robot.ended);
}

TEST(Relay, TheLastOfThoseWhoComeBackIsTheRobotIfTheOneBeforeIsDead) {
  AtRelay at;
  HandRobot dead(at, "robot7", "robot7-token");
  ASSERT_TRUE(dead.hears(1));
  HandRobot given_up(at, "robot7", "robot7-token");
  ASSERT_TRUE(dead.hears(2));
  HandRobot last(at, "robot7", "robot7-token");
  ASSERT_TRUE(last.hears(1));
  EXPECT_THAT(last.said, ElementsAre("welcome clients"));
  EXPECT_THAT(dead.said, ElementsAre("welcome clients", "ping"));
  EXPECT_TRUE(at.loop.until([&] { return dead.ended && given_up.ended; }));
  EXPECT_THAT(given_up.said, testing::IsEmpty());
  EXPECT_FALSE(at.relay->status().robots[0].twin);
}

TEST(Relay, ANameBelongsToItsToken) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token");
  ASSERT_TRUE(robot.hears(1));
  for (const char* token : {"robot8-token", "anything"}) {
    HandRobot thief(at, "robot7", token);
    ASSERT_TRUE(thief.hears(1));
    EXPECT_THAT(thief.said, ElementsAre("refused"));
    EXPECT_TRUE(at.loop.until([&] { return thief.ended; }));
  }
  HandRobot nameless(at, "Robot_7", "robot7-token");
  EXPECT_TRUE(at.loop.until([&] { return nameless.ended; }));
  EXPECT_FALSE(robot.ended);
  HandRobot again(at, "robot7", "robot7-token");
  ASSERT_TRUE(again.hears(1));
  EXPECT_THAT(again.said, ElementsAre("welcome clients"));
  EXPECT_TRUE(at.loop.until([&] { return robot.ended; }));
  EXPECT_FALSE(again.ended);
}

TEST(Relay, ALineGivesTheNameToOneTokenOnce) {
  AtRelay at;
  HandRobot before(at, "robot7", "robot7-token");
  ASSERT_TRUE(before.hears(1));
  const std::string code = " robot7-token-of-a-line";
  for (const std::string no :
       {"robot7-token-of-a-line", "a-token-of-its-own robot8-token-of-a-line",
        "a-token-of-its-own robot8-token", "short robot7-token-of-a-line"}) {
    HandRobot robot(at, "robot7", no);
    ASSERT_TRUE(robot.hears(1));
    EXPECT_EQ(robot.said[0], "refused") << no;
  }
  EXPECT_THAT(at.handed_over, testing::IsEmpty());
  at.no_room = "the disk is full";
  for (int i = 0; i < 2; ++i) {
    HandRobot early(at, "robot7", "a-token-of-its-own" + code);
    ASSERT_TRUE(early.hears(1));
    EXPECT_EQ(early.said[0], "refused");
  }
  EXPECT_THAT(at.errors, testing::SizeIs(1));  // as often as it may try
  at.no_room.clear();
  HandRobot robot(at, "robot7", "a-token-of-its-own" + code);
  ASSERT_TRUE(robot.hears(1));
  EXPECT_EQ(robot.said[0], "welcome clients");
  EXPECT_THAT(at.handed_over, ElementsAre("robot7", "robot7", "robot7"));
  HandRobot thief(at, "robot7", "a-token-of-another" + code);
  ASSERT_TRUE(thief.hears(1));
  EXPECT_EQ(thief.said[0], "refused");
  // The answer to the first may have been lost.
  HandRobot again(at, "robot7", "a-token-of-its-own" + code);
  ASSERT_TRUE(again.hears(1));
  EXPECT_EQ(again.said[0], "welcome clients");
  EXPECT_EQ(at.handed_over.size(), 3U);
  EXPECT_EQ(at.refused(RelayRefusal::kWrongLogin), 7U);
}

// The file may be locked by others, and is written to a disk.
TEST(Relay, PairsGoOnWhileANameIsGiven) {
  AtRelay at;
  HandRobot other(at, "robot8", "robot8-token");
  ASSERT_TRUE(other.hears(1));
  RawPeer visitor(at.port());
  visitor.send(visitor_hello("robot8"));
  ASSERT_TRUE(other.hears(2));
  RawPeer ticket(at.port());
  ticket.send(ticket_hello("robot8", other.ticket(1)));
  ASSERT_TRUE(ticket.sees(at.loop, visitor_hello("robot8")));
  std::promise<void> free;
  at.hold = free.get_future().share();
  HandRobot robot(at, "robot7", "a-token-of-its-own robot7-token-of-a-line");
  HandRobot thief(at, "robot7", "a-token-of-another robot7-token-of-a-line");
  at.loop.run_for(100ms);
  visitor.send("to the robot");
  EXPECT_TRUE(ticket.sees(at.loop, "to the robot"));
  other.lines->say("ping");
  EXPECT_TRUE(other.hears(3));
  at.relay->every_second();
  EXPECT_THAT(robot.said, testing::IsEmpty());
  EXPECT_FALSE(robot.ended || thief.ended);
  free.set_value();
  ASSERT_TRUE(robot.hears(1) && thief.hears(1));
  const std::vector<std::string> said{robot.said[0], thief.said[0]};
  EXPECT_THAT(said, testing::UnorderedElementsAre("welcome clients", "refused"));
  EXPECT_THAT(at.handed_over, ElementsAre("robot7"));
}

TEST(Relay, AResetPassesThroughWhileTheOtherEndTakesNothing) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token");
  ASSERT_TRUE(robot.hears(1));
  for (const bool from_visitor : {true, false}) {
    RawPeer visitor(at.port());
    visitor.send(visitor_hello("robot7"));
    const std::size_t line = from_visitor ? 1 : 2;
    ASSERT_TRUE(robot.hears(line + 1));
    RawPeer ticket(at.port());
    ticket.send(ticket_hello("robot7", robot.ticket(line)));
    ASSERT_TRUE(ticket.sees(at.loop, visitor_hello("robot7")));
    ASSERT_EQ(at.relay->status().all.pairs, 1U);
    RawPeer& gone = from_visitor ? visitor : ticket;
    // The other one reads nothing.
    for (int full = 0; full < 30; ++full) {
      if (gone.send_some(std::string(65536, 'x'))) full = 0;
      at.loop.run_for(1ms);
    }
    at.relay->every_second();
    EXPECT_EQ(at.relay->status().all.pairs, 1U);
    gone.reset();
    EXPECT_TRUE(at.loop.until([&] {
      at.relay->every_second();
      return at.relay->status().all.pairs == 0;
    }));
    RawPeer& other = from_visitor ? ticket : visitor;
    EXPECT_TRUE(other.ends(at.loop));
  }
}

TEST(Relay, ItsStatusSaysWhoAndHowMuch) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token");
  HandRobot idle(at, "idle", "idle-token");
  ASSERT_TRUE(robot.hears(1) && idle.hears(1));
  RawPeer unknown(at.port());
  unknown.send(visitor_hello("unknown"));
  EXPECT_TRUE(unknown.ends(at.loop));
  const std::string hello = visitor_hello("robot7");
  {
    RawPeer visitor(at.port());
    visitor.send(hello);
    ASSERT_TRUE(robot.hears(2));
    RawPeer ticket(at.port());
    ticket.send(ticket_hello("robot7", robot.ticket(1)));
    ASSERT_TRUE(ticket.sees(at.loop, hello));
    ticket.send("from the robot");
    ASSERT_TRUE(visitor.sees(at.loop, "from the robot"));
    ASSERT_TRUE(at.loop.until([&] { return at.relay->status().all.to_visitors == 14; }));
    const RelayStatus status = at.relay->status();
    ASSERT_EQ(status.robots.size(), 2U);
    EXPECT_EQ(status.robots[0].name, "idle");
    EXPECT_EQ(status.robots[0].use.visitors, 0U);
    EXPECT_THAT(status.robots[1].peer, StartsWith("127.0.0.1:"));
    EXPECT_EQ(status.robots[1].use.pairs, 1U);
    EXPECT_EQ(status.all.to_robot, hello.size());
    EXPECT_EQ(status.accepted, 5U);
    EXPECT_EQ(at.refused(RelayRefusal::kNoSuchRobot), 1U);
    robot.lines->end();
    ASSERT_TRUE(at.loop.until([&] { return at.relay->status().robots[1].peer.empty(); }));
    EXPECT_EQ(at.relay->status().robots[1].use.pairs, 1U);
  }
  ASSERT_TRUE(at.loop.until([&] { return at.relay->status().robots.size() == 1; }));
  EXPECT_EQ(at.relay->status().all.visitors, 1U);
  EXPECT_EQ(at.relay->status().all.pairs, 0U);
}

TEST(Relay, ATokenThatIsWithdrawnEndsTheConnection) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token");
  HandRobot other(at, "robot8", "robot8-token");
  ASSERT_TRUE(robot.hears(1) && other.hears(1));
  ByName::withdrawn = "robot7-token";
  at.relay->every_second();
  ByName::withdrawn.clear();
  EXPECT_TRUE(at.loop.until([&] { return robot.ended; }));
  EXPECT_FALSE(other.ended);
}

TEST(Relay, ARobotSaysOnlyWhatItMay) {
  AtRelay at;
  for (const char* line : {"login robot7-token", "visitor", "pinging", "a line that is too long"}) {
    HandRobot robot(at, "robot7", "robot7-token");
    ASSERT_TRUE(robot.hears(1));
    robot.lines->say("ping");
    ASSERT_TRUE(robot.hears(2));
    EXPECT_EQ(robot.said[1], "pong");
    robot.lines->say(line);
    EXPECT_TRUE(at.loop.until([&] { return robot.ended; })) << line;
  }
  HandRobot early(at, "robot7", "x");
  early.lines->end();
}

TEST(Relay, ARobotThatNeverStopsAskingIsClosed) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token");
  ASSERT_TRUE(robot.hears(1));
  for (int i = 0; i < kRobotLinesAtOnce; ++i) robot.lines->say("ping");
  ASSERT_TRUE(robot.hears(1 + kRobotLinesAtOnce));
  EXPECT_FALSE(robot.ended);
  for (int i = 0; i < kRobotLinesAtOnce; ++i) robot.lines->say("ping");
  EXPECT_TRUE(at.loop.until([&] { return robot.ended; }));
}

TEST(Relay, ControlHandshakesOfAnAddressAreLimited) {
  AtRelay at(2);
  for (int i = 0; i < 3; ++i) {
    HandRobot robot(at, "robot7", "no token");
    EXPECT_TRUE(at.loop.until([&] { return robot.ended; }));
    EXPECT_EQ(robot.said.empty(), i == 2) << i;
  }
}

TEST(Relay, AServerSaysItsTokenToNoOtherThanItsRelay) {
  AtRelay at;
  Loop& loop = at.loop;
  Side server(loop);
  const Authority::Files files = relay_authority().sign("robot", "DNS:robot7");
  ListenOptions options;
  options.port = 0;
  options.tls = TlsOptions{files.certificate, files.key};
  bool asked = false;
  options.relay = RelayOptions{{true, "127.0.0.1", at.port(), "/", "robot7"}, {}, [&asked] {
                                 asked = true;
                                 return std::string{"robot7-token"};
                               }};
  options.relay->tls.pins = {"AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA="};
  ASSERT_EQ(server.network.listen(options), "");
  EXPECT_TRUE(loop.until([&] { return !server.logs.empty(); }));
  EXPECT_THAT(server.logs.front(), testing::HasSubstr("which is not in tls.pin"));
  EXPECT_FALSE(asked);
}

}  // namespace
}  // namespace connect_bridge::test
