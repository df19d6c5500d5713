#include <gmock/gmock.h>

#include "net/tls/authority.hpp"
#include "unit/relay/relay_bed.hpp"

namespace connect_bridge::test {
namespace {

using testing::ElementsAre;
using testing::StartsWith;

TEST(Relay, JoinsAVisitorWithTheRobotThatItNames) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token");
  ASSERT_TRUE(robot.hears(1));
  RawPeer visitor(at.port());
  const std::string hello = visitor_hello("ROBOT7");
  for (const char byte : hello) visitor.send({&byte, 1});
  ASSERT_TRUE(robot.hears(2));
  EXPECT_THAT(robot.said, ElementsAre("welcome clients", StartsWith("visitor ")));
  EXPECT_EQ(robot.said[1].substr(8 + 64),
            " 127.0.0.1 " + std::to_string(ntohs(visitor.address().sin_port)));
  RawPeer ticket(at.port());
  ticket.send(ticket_hello("robot7", robot.ticket(1)));
  ASSERT_TRUE(ticket.sees(at.loop, hello));
  EXPECT_EQ(ticket.text, hello);
  ticket.send("from the robot");
  EXPECT_TRUE(visitor.sees(at.loop, "from the robot"));
  EXPECT_EQ(visitor.text, "from the robot");
  // The end of one direction passes through, and leaves the other.
  visitor.half_close();
  EXPECT_TRUE(ticket.ends(at.loop));
  ticket.send("and the rest");
  EXPECT_TRUE(visitor.sees(at.loop, "and the rest"));
  EXPECT_FALSE(visitor.ended);
  ticket.half_close();
  EXPECT_TRUE(visitor.ends(at.loop));
}

TEST(Relay, ATicketWorksOnceAndNoOtherDoes) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token");
  RawPeer visitor(at.port());
  ASSERT_TRUE(robot.hears(1));
  visitor.send(visitor_hello("robot7"));
  ASSERT_TRUE(robot.hears(2));
  const std::string hello = ticket_hello("robot7", robot.ticket(1));
  RawPeer wrong(at.port());
  wrong.send(ticket_hello("robot7", std::string(64, '0')));
  EXPECT_TRUE(wrong.ends(at.loop));
  RawPeer first(at.port());
  first.send(hello);
  EXPECT_TRUE(first.sees(at.loop, visitor_hello("robot7")));
  RawPeer second(at.port());
  second.send(hello);
  EXPECT_TRUE(second.ends(at.loop));
  EXPECT_EQ(second.text + wrong.text, "");
  EXPECT_FALSE(first.ended);
}

// The connection before was dead without a word, as behind a NAT that has forgotten it.
TEST(Relay, ATicketThatNobodyUsesEnds) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token");
  ASSERT_TRUE(robot.hears(1));
  RawPeer visitor(at.port());
  visitor.send(visitor_hello("robot7"));
  EXPECT_TRUE(visitor.ends(at.loop, 20s));
  EXPECT_EQ(visitor.text, kNoSuchRobot);
  RawPeer late(at.port());
  late.send(ticket_hello("robot7", robot.ticket(1)));
  EXPECT_TRUE(late.ends(at.loop));
}

TEST(Relay, WhoIsAbsentLooksLikeWhoIsUnknown) {
  AtRelay at;
  {
    HandRobot robot(at, "absent", "absent-token");
    ASSERT_TRUE(robot.hears(1));
  }
  for (const char* name : {"absent", "unknown", "", "no.name", "a name"}) {
    RawPeer visitor(at.port());
    visitor.send(visitor_hello(name));
    EXPECT_TRUE(visitor.ends(at.loop));
    EXPECT_EQ(visitor.text, kNoSuchRobot) << name;
  }
}

TEST(Relay, TheOldestSilentCallerOfAnAddressGivesWay) {
  AtRelay at;
  std::vector<std::unique_ptr<RawPeer>> silent;
  for (int i = 0; i < 17; ++i) {
    silent.push_back(std::make_unique<RawPeer>(at.port()));
    at.loop.run_for(5ms);
  }
  EXPECT_TRUE(silent[0]->ends(at.loop, 3s));
  silent[16]->poll();
  EXPECT_FALSE(silent[16]->ended);
  // All of them end in time.
  EXPECT_TRUE(silent[16]->ends(at.loop, 20s));
}

// They come from 24 addresses, more than all places together.
TEST(Relay, SilentCallersKeepNoVisitorOut) {
  AtRelay at(30, {*AddressRange::parse("127.0.0.1")});
  HandRobot robot(at, "robot7", "robot7-token", proxy_header("192.0.2.7"));
  ASSERT_TRUE(robot.hears(1));
  std::vector<std::unique_ptr<RawPeer>> silent;
  const auto flood = [&](int count) {
    for (int i = 0; i < count; ++i) {
      silent.push_back(std::make_unique<RawPeer>(at.port()));
      silent.back()->send(proxy_header("203.0.113." + std::to_string(silent.size() % 24)));
      if (i % 8 == 0) at.loop.run_for(5ms);
    }
    at.loop.run_for(20ms);
  };
  RawPeer waits(at.port());
  waits.send(proxy_header("198.51.100.1") + visitor_hello("robot7"));
  ASSERT_TRUE(robot.hears(2));
  RawPeer slow(at.port());
  slow.send(proxy_header("198.51.100.2"));
  at.loop.run_for(20ms);
  flood(340);
  EXPECT_GE(at.refused(RelayRefusal::kGaveWay), 20U);
  slow.send(visitor_hello("robot7"));
  ASSERT_TRUE(robot.hears(3));
  for (const std::size_t line : {1U, 2U}) {
    RawPeer ticket(at.port());
    ticket.send(proxy_header("192.0.2.7") + ticket_hello("robot7", robot.ticket(line)));
    EXPECT_TRUE(ticket.sees(at.loop, visitor_hello("robot7")));
  }
}

TEST(Relay, WhoBringsMostOfThoseThatWaitForARobotGivesWay) {
  AtRelay at(30, {*AddressRange::parse("127.0.0.1")});
  HandRobot robot(at, "robot7", "robot7-token", proxy_header("192.0.2.7"));
  ASSERT_TRUE(robot.hears(1));
  std::vector<std::unique_ptr<RawPeer>> visitors;
  for (int i = 0; i < 20; ++i) {
    visitors.push_back(std::make_unique<RawPeer>(at.port()));
    visitors.back()->send(proxy_header(i == 0 ? "198.51.100.1" : "203.0.113.1") +
                          visitor_hello("robot7"));
    ASSERT_TRUE(robot.hears(static_cast<std::size_t>(i) + 2));
  }
  EXPECT_EQ(at.refused(RelayRefusal::kGaveWay), 4U);
  RawPeer ticket(at.port());
  ticket.send(proxy_header("192.0.2.7") + ticket_hello("robot7", robot.ticket(1)));
  EXPECT_TRUE(ticket.sees(at.loop, visitor_hello("robot7")));
  EXPECT_TRUE(visitors[1]->ends(at.loop));
}

// Each costs a robot on a metered network some 2 kB.
TEST(Relay, VisitorsWithoutTheWordOfARobotsClientsAreFew) {
  AtRelay at(30, {*AddressRange::parse("127.0.0.1")});
  HandRobot robot(at, "robot7", "robot7-token", proxy_header("192.0.2.7"));
  ASSERT_TRUE(robot.hears(1));
  const std::string word(64, 'a');
  robot.lines->say("clients " + word);
  robot.lines->say("ping");
  ASSERT_TRUE(robot.hears(2));
  std::vector<std::unique_ptr<RawPeer>> others;
  const auto come = [&](const std::vector<std::string>& offers) {
    others.push_back(std::make_unique<RawPeer>(at.port()));
    others.back()->send(proxy_header("203.0.113." + std::to_string(others.size())) +
                        visitor_hello("robot7", offers));
  };
  for (const std::string& wrong : {std::string(64, 'b'), std::string{"x"}})
    come({kClientProtocol, wrong});
  come({"h2", word});
  come({kClientProtocol, "1", "2", "3", "4", word});
  while (others.size() < kOthersAtOnce + 5) come({});
  EXPECT_TRUE(others.back()->ends(at.loop));
  EXPECT_EQ(others.back()->text, kNoSuchRobot);
  EXPECT_EQ(at.refused(RelayRefusal::kVisitorsOfRobot), 5U);
  ASSERT_TRUE(robot.hears(2U + kOthersAtOnce));
  EXPECT_EQ(robot.said.size(), 2U + kOthersAtOnce);
  for (std::size_t i = 1; i <= 10; ++i) {
    come({kClientProtocol, std::string(64, 'c'), word});
    ASSERT_TRUE(robot.hears(2 + kOthersAtOnce + i));
  }
  // Of those that wait they stay.
  EXPECT_EQ(at.refused(RelayRefusal::kGaveWay), 4U);
  RawPeer ticket(at.port());
  ticket.send(proxy_header("192.0.2.7") + ticket_hello("robot7", robot.ticket(2 + kOthersAtOnce)));
  EXPECT_TRUE(ticket.sees(at.loop, std::string(64, 'c')));
}

TEST(Relay, AWordIsSixtyFourDigits) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token");
  ASSERT_TRUE(robot.hears(1));
  robot.lines->say("clients " + std::string(64, 'x'));
  EXPECT_TRUE(at.loop.until([&] { return robot.ended; }));
}

// Each costs the robot a connection, which it may pay for.
TEST(Relay, VisitorsOfAnAddressAreLimited) {
  AtRelay at(3);
  HandRobot robot(at, "robot7", "robot7-token");
  ASSERT_TRUE(robot.hears(1));
  RawPeer first(at.port()), second(at.port()), third(at.port());
  first.send(visitor_hello("robot7"));
  second.send(visitor_hello("robot7"));
  ASSERT_TRUE(robot.hears(3));
  third.send(visitor_hello("robot7"));
  EXPECT_TRUE(third.ends(at.loop, 3s));
  EXPECT_EQ(third.text, kNoSuchRobot);
  EXPECT_EQ(robot.said.size(), 3U);
}

TEST(Relay, ATrustedProxySaysForWhomItConnects) {
  AtRelay at(1, {*AddressRange::parse("127.0.0.1")});
  const std::string header = "PROXY TCP4 203.0.113.7 192.0.2.1 4711 443\r\n";
  RawPeer unheard(at.port());
  unheard.send(visitor_hello("robot7"));
  EXPECT_TRUE(unheard.ends(at.loop, 3s));
  EXPECT_EQ(unheard.text, "");
  RawPeer visitor(at.port());
  const std::string all = header + visitor_hello("robot7");
  for (const char byte : all) visitor.send({&byte, 1});
  EXPECT_TRUE(visitor.ends(at.loop, 3s));
  EXPECT_EQ(visitor.text, kNoSuchRobot);
  EXPECT_EQ(at.refused(RelayRefusal::kNoSuchRobot), 1U);
  // Its own check is no visitor.
  RawPeer check(at.port());
  check.send("PROXY UNKNOWN\r\n" + visitor_hello("robot7"));
  EXPECT_TRUE(check.ends(at.loop, 3s));
}

TEST(Relay, WhatIsNoTlsIsClosedAtOnce) {
  AtRelay at;
  for (const std::string junk : {"GET / HTTP/1.1\r\n\r\n", "SSH-2.0-x\r\n", "PROXY TCP4 "}) {
    RawPeer caller(at.port());
    caller.send(junk);
    EXPECT_TRUE(caller.ends(at.loop, 3s)) << junk;
    EXPECT_EQ(caller.text, "");
  }
}

// The real server and client of src/net.
struct Both {
  explicit Both(AtRelay& at) : server(at.loop), client(at.loop) {
    Authority::Files files = relay_authority().sign("robot", "DNS:robot7");
    ListenOptions options;
    options.port = 0;
    options.tls = TlsOptions{files.certificate, files.key};
    certificate = files.certificate;
    options.relay = RelayOptions{{true, "127.0.0.1", at.port(), "/", "robot7"}, {}, [] {
                                   return std::string{"robot7-token"};
                                 }};
    options.relay->tls.ca_file = relay_authority().ca;
    EXPECT_EQ(server.network.listen(options), "");
    dial.url = {true, "127.0.0.1", at.port(), "/", "robot7"};
    dial.tls.ca_file = relay_authority().ca;
  }
  [[nodiscard]] bool reached() const {
    return !server.logs.empty() && server.logs.back().starts_with("connected to the relay");
  }

  Side server, client;
  DialOptions dial;
  std::string certificate;
};

TEST(Relay, AServerTakesWhoComesThroughItAsByItsListener) {
  AtRelay at;
  Both both(at);
  ASSERT_TRUE(at.loop.until([&] { return both.reached(); }));
  both.client.network.dial(kDial, both.dial);
  ASSERT_TRUE(at.loop.until([&] { return !both.server.opened.empty(); }));
  ASSERT_TRUE(at.loop.until([&] { return !both.client.opened.empty(); }));
  EXPECT_THAT(both.server.openings[0].peer, StartsWith("127.0.0.1:"));
  EXPECT_THAT(both.client.peers[kDial], StartsWith("robot7@127.0.0.1:"));
  both.client.send(kDial, std::string(300000, 'x'));
  ASSERT_TRUE(at.loop.until([&] { return both.server.received_bytes == 300000; }));
  both.server.send(both.server.opened[0], std::string(300000, 'y'));
  ASSERT_TRUE(at.loop.until([&] { return both.client.received_bytes == 300000; }));
}

// By its pin, or as it has met the robot before.
TEST(Relay, AClientShowsThatItKnowsTheRobot) {
  AtRelay at(100);
  Both both(at);
  std::string problem;
  const std::string pin = pin_of_file(both.certificate, problem);
  ASSERT_TRUE(at.loop.until([&] { return both.reached(); }));
  both.client.network.dial(ConnectionId{1}, both.dial);
  ASSERT_TRUE(at.loop.until([&] { return both.server.opened.size() == 1; }));
  const Traffic before = both.server.network.traffic();
  std::vector<std::unique_ptr<RawPeer>> others;
  for (int i = 0; i < kOthersAtOnce; ++i) {
    others.push_back(std::make_unique<RawPeer>(at.port()));
    others.back()->send(visitor_hello("robot7"));
    at.loop.run_for(10ms);
  }
  ASSERT_TRUE(others.back()->ends(at.loop));
  EXPECT_EQ(others.back()->text, kNoSuchRobot);
  // Who has met it.
  both.client.network.dial(ConnectionId{2}, both.dial);
  ASSERT_TRUE(at.loop.until([&] { return both.server.opened.size() == 2; }));
  Side stranger(at.loop), paired(at.loop);
  stranger.network.dial(kDial, both.dial);
  ASSERT_TRUE(at.loop.until([&] { return stranger.failure_count == 1; }));
  EXPECT_THAT(stranger.failures[kDial], testing::HasSubstr("is connected to the relay there"));
  DialOptions dial = both.dial;
  dial.tls = {};
  dial.tls.pins = {pin};
  paired.network.dial(kDial, dial);
  EXPECT_TRUE(at.loop.until([&] { return both.server.opened.size() == 3; }));
  others.clear();
  // What strangers cost is counted: at least a ClientHello of each.
  EXPECT_TRUE(at.loop.until([&] {
    return both.server.network.traffic().received >
           before.received + (kOthersOfNetworkAtOnce - 1) * 100;
  }));
}

TEST(Relay, TheNameOfTheRobotIsWhatItsCertificateMustHave) {
  AtRelay at;
  Both both(at);
  ASSERT_TRUE(at.loop.until([&] { return both.reached(); }));
  HandRobot other(at, "robot8", "robot8-token");
  ASSERT_TRUE(other.hears(1));
  both.dial.url.robot = "robot8";
  both.client.network.dial(kDial, both.dial);
  // The relay, or robot8, leads it to robot7.
  ASSERT_TRUE(other.hears(2));
  RawPeer detour(at.port());
  detour.send(ticket_hello("robot8", other.ticket(1)));
  ASSERT_TRUE(at.loop.until([&] { return detour.poll(), !detour.text.empty(); }));
  RawPeer direct(both.server.network.listen_port());
  direct.send(detour.text);
  ASSERT_TRUE(at.loop.until([&] { return direct.poll(), direct.text.size() > 200; }));
  at.loop.run_for(20ms);
  direct.poll();
  detour.send(direct.text);
  ASSERT_TRUE(at.loop.until([&] { return both.client.failure_count > 0; }));
  EXPECT_THAT(both.client.failures[kDial], testing::HasSubstr("is not for 'robot8'"));
  EXPECT_TRUE(both.server.opened.empty());
}

TEST(Relay, AServerComesBackWhenTheRelayDoes) {
  AtRelay at;
  Both both(at);
  ASSERT_TRUE(at.loop.until([&] { return both.reached(); }));
  ByName::withdrawn = "robot7-token";
  at.relay->every_second();  // ends its control connection
  ByName::withdrawn.clear();
  ASSERT_TRUE(at.loop.until([&] { return !both.reached(); }));
  ASSERT_TRUE(at.loop.until([&] { return both.reached(); }));
}

TEST(Relay, AServerThatIsHereStaysWhenACopyOfItComes) {
  AtRelay at;
  Both both(at);
  ASSERT_TRUE(at.loop.until([&] { return both.reached(); }));
  Both copy(at);
  const auto refused = [&] {
    return !copy.server.logs.empty() &&
           copy.server.logs.back().find("another machine has the same token") != std::string::npos;
  };
  ASSERT_TRUE(at.loop.until(refused));
  const auto accepted = at.relay->status().accepted;
  at.loop.run_for(1500ms);  // it waits
  EXPECT_EQ(at.relay->status().accepted, accepted);
  EXPECT_TRUE(both.reached());
  EXPECT_TRUE(refused());
}

}  // namespace
}  // namespace connect_bridge::test
