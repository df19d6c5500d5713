#include "relay/relay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/ssl.h>

#include "net/relay_door.hpp"
#include "net/relay_wire.hpp"
#include "unit/net/certificates.hpp"
#include "unit/net/harness.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

using testing::ElementsAre;
using testing::StartsWith;

const std::string kNoSuchRobot{"\x15\x03\x03\x00\x02\x02\x70", 7};

Authority& relay_authority() {
  static Authority made{scratch_folder()};
  return made;
}

// A robot's token is its name and "-token".
struct ByName : Authenticator {
  Judgement judge(const Attempt& attempt, Stamp) override {
    const std::string token(attempt.credential.begin(), attempt.credential.end());
    const auto end = token.find("-token");
    if (end == std::string::npos || token == withdrawn) return {};
    const bool is_code = token.find("-token-of-a-line") != std::string::npos;
    return {Identity{token.substr(0, end), is_code ? Groups{kLineGroup} : Groups{}}, {}};
  }
  Refreshed refresh(Stamp) override { return {{}, {"looked"}, {}, {}}; }
  using Groups = std::vector<std::string>;
  static inline std::string withdrawn;
};

// Only this token, and no code any longer.
struct ByDigest : ByName {
  explicit ByDigest(const Digest& of) : digest(of) {}
  Judgement judge(const Attempt& attempt, Stamp) override {
    return sha256(attempt.credential) == digest ? Judgement{Identity{"robot7", {}}, {}}
                                                : Judgement{};
  }
  Digest digest;
};

// The ClientHello of somebody who wants to get to a robot.
std::string visitor_hello(const std::string& robot) {
  const auto with_length = [](const std::string& text) {
    return std::string{static_cast<char>(text.size() >> 8U), static_cast<char>(text.size())} + text;
  };
  const std::string kind_of_name(1, '\0');
  const std::string name = with_length(with_length(kind_of_name + with_length(robot)));
  const std::string extensions = with_length(std::string(2, '\0') + name);
  const std::string body = "\x03\x03" + std::string(32, 'r') + std::string(1, '\0') +
                           with_length("\x13\x01") + std::string("\x01\x00", 2) + extensions;
  const std::string message = "\x01" + std::string(1, '\0') + with_length(body);
  return "\x16\x03\x01" + with_length(message);
}

struct AtRelay {
  explicit AtRelay(int calls = 30, AddressRanges proxies = {}) {
    const Authority::Files files = relay_authority().sign("relay", "IP:127.0.0.1");
    RelaySetup setup;
    setup.addresses = {"127.0.0.1"};
    setup.tls = TlsOptions{files.certificate, files.key};
    setup.robots = std::make_unique<ByName>();
    setup.hand_over = [this](const std::string& robot, const Digest& token,
                             std::string& problem) -> std::unique_ptr<Authenticator> {
      handed_over.push_back(robot);
      problem = no_room;
      return no_room.empty() ? std::make_unique<ByDigest>(token) : nullptr;
    };
    setup.address_calls_at_once = calls;
    setup.proxies = std::move(proxies);
    setup.address_call_period = 800s;
    relay = std::make_shared<Relay>(loop.io, std::move(setup), [](LogLevel, const std::string&) {});
    EXPECT_EQ(relay->open(), "");
  }
  ~AtRelay() {
    relay->close();
    loop.run_for(1ms);
  }
  [[nodiscard]] std::uint16_t port() const { return relay->port(); }

  [[nodiscard]] std::uint64_t refused(RelayRefusal why) const {
    return relay->status().refused[static_cast<std::size_t>(why)];
  }

  Loop loop;
  std::shared_ptr<Relay> relay;
  std::vector<std::string> handed_over;
  std::string no_room;
};

// The control connection of a robot, by hand.
struct HandRobot {
  HandRobot(AtRelay& at, const std::string& name, const std::string& token) : loop(at.loop) {
    std::string problem;
    TcpSocket socket(loop.io.get_executor());
    socket.connect({asio::ip::make_address("127.0.0.1"), at.port()});
    TlsOptions trusting;
    trusting.ca_file = relay_authority().ca;
    lines = std::make_shared<TlsLines>(std::move(socket), make_client_tls(trusting, problem));
    const std::string offer = protocol_list({kRelayProtocol});
    SSL_set_alpn_protos(lines->tls(), view_of(offer).data(), static_cast<unsigned>(offer.size()));
    SSL_set_tlsext_host_name(lines->tls(), name.c_str());
    lines->shake_hands(false, {}, [this, token](ErrorCode error) {
      if (error) return static_cast<void>(ended = true);
      lines->open(kRelayLineMax, {[this](std::string_view line) { said.emplace_back(line); },
                                  [this](const std::string&) { ended = true; }});
      lines->say("login " + token);
    });
  }
  ~HandRobot() {
    lines->end();
    loop.run_for(1ms);
  }
  bool hears(std::size_t lines_said) {
    return loop.until([&] { return said.size() >= lines_said; });
  }
  // The ticket of the visitor in this line.
  [[nodiscard]] std::string ticket(std::size_t line) const { return said.at(line).substr(8, 64); }

  Loop& loop;
  std::shared_ptr<TlsLines> lines;
  std::vector<std::string> said;
  bool ended = false;
};

TEST(Relay, JoinsAVisitorWithTheRobotThatItNames) {
  AtRelay at;
  HandRobot robot(at, "robot7", "robot7-token");
  ASSERT_TRUE(robot.hears(1));
  RawPeer visitor(at.port());
  const std::string hello = visitor_hello("ROBOT7");
  for (const char byte : hello) visitor.send({&byte, 1});
  ASSERT_TRUE(robot.hears(2));
  EXPECT_THAT(robot.said, ElementsAre("welcome", StartsWith("visitor ")));
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
  EXPECT_THAT(again.said, ElementsAre("welcome"));
  EXPECT_TRUE(at.loop.until([&] { return robot.ended; }));
  EXPECT_FALSE(again.ended);
}

// The token is the robot's own: whoever saw the line has only its code, which is used.
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
  HandRobot early(at, "robot7", "a-token-of-its-own" + code);
  ASSERT_TRUE(early.hears(1));
  EXPECT_EQ(early.said[0], "refused");
  at.no_room.clear();
  HandRobot robot(at, "robot7", "a-token-of-its-own" + code);
  ASSERT_TRUE(robot.hears(1));
  EXPECT_EQ(robot.said[0], "welcome");
  EXPECT_THAT(at.handed_over, ElementsAre("robot7", "robot7"));
  HandRobot thief(at, "robot7", "a-token-of-another" + code);
  ASSERT_TRUE(thief.hears(1));
  EXPECT_EQ(thief.said[0], "refused");
  // The answer to the first may have been lost.
  HandRobot again(at, "robot7", "a-token-of-its-own" + code);
  ASSERT_TRUE(again.hears(1));
  EXPECT_EQ(again.said[0], "welcome");
  EXPECT_EQ(at.handed_over.size(), 2U);
  EXPECT_EQ(at.refused(RelayRefusal::kWrongLogin), 6U);
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
    const RelayStatus status = at.relay->status();
    ASSERT_EQ(status.robots.size(), 2U);
    EXPECT_EQ(status.robots[0].name, "idle");
    EXPECT_EQ(status.robots[0].use.visitors, 0U);
    EXPECT_THAT(status.robots[1].peer, StartsWith("127.0.0.1:"));
    EXPECT_EQ(status.robots[1].use.pairs, 1U);
    EXPECT_EQ(status.all.to_robot, hello.size());
    EXPECT_EQ(status.all.to_visitors, 14U);
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

// Each costs the relay a signature.
TEST(Relay, ControlHandshakesOfAnAddressAreLimited) {
  AtRelay at(2);
  for (int i = 0; i < 3; ++i) {
    HandRobot robot(at, "robot7", "no token");
    EXPECT_TRUE(at.loop.until([&] { return robot.ended; }));
    EXPECT_EQ(robot.said.empty(), i == 2) << i;
  }
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
    options.relay = RelayOptions{{true, "127.0.0.1", at.port(), "/", "robot7"}, {}, [] {
                                   return std::string{"robot7-token"};
                                 }};
    options.relay->tls.ca_file = relay_authority().ca;
    EXPECT_EQ(server.network.listen(options), "");
    dial.url = {true, "127.0.0.1", at.port(), "/", "robot7"};
    dial.tls.ca_file = relay_authority().ca;
  }
  [[nodiscard]] bool reached() const {
    return !server.logs.empty() && server.logs.back().starts_with("reached through the relay");
  }

  Side server, client;
  DialOptions dial;
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

TEST(Relay, AServerComesBackWhenTheRelayDoes) {
  AtRelay at;
  Both both(at);
  ASSERT_TRUE(at.loop.until([&] { return both.reached(); }));
  {
    HandRobot same(at, "robot7", "robot7-token");  // ends its control connection
    ASSERT_TRUE(at.loop.until([&] { return !both.reached(); }));
  }
  ASSERT_TRUE(at.loop.until([&] { return both.reached(); }));
}

}  // namespace
}  // namespace connect_bridge::test
