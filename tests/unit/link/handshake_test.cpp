// The table of docs/protocol.md section "States", and the results of a login.
#include <gtest/gtest.h>

#include "unit/link/script.hpp"

namespace connect_bridge::link_test {
namespace {

using State = Connection::State;

TEST(Handshake, AServerAsksForTheLoginAndThenWelcomes) {
  Script script(true);
  EXPECT_EQ(script.link.state(), State::kAwaitHello);
  EXPECT_EQ(script.binary(hello(kPeer, kSession)), "-");
  EXPECT_EQ(script.link.state(), State::kAwaitLogin);
  EXPECT_EQ(script.binary(login("jwt")), "ask jwt");
  EXPECT_EQ(script.link.state(), State::kAuthenticating);
  EXPECT_EQ(script.sent(), "");  // nothing at all before the login has succeeded
  EXPECT_EQ(script.link.peer().side, token(kPeer));
  EXPECT_EQ(script.link.peer().session, token(kSession));
  EXPECT_EQ(script.link.peer().node, "/peer");
  EXPECT_EQ(script.link.peer().address, "10.0.0.2:4");
  EXPECT_EQ(script.authenticated("anna"), "open");
  EXPECT_TRUE(script.link.open());
  EXPECT_EQ(script.link.peer().identity.name, "anna");
  const auto packet = script.link.next_packet(now_ms(0));
  ASSERT_TRUE(packet);
  EXPECT_FALSE(packet->text);
  const auto welcome = decode_welcome(joined(*packet));
  ASSERT_TRUE(welcome);
  EXPECT_EQ(welcome.value().side, token(kOwn));
  EXPECT_EQ(welcome.value().session, token(kSession));
  EXPECT_EQ(welcome.value().dead_after_ms, 3000U);
  EXPECT_EQ(welcome.value().message_bytes_max, 64U << 20);
  EXPECT_EQ(welcome.value().node, "/own");
  EXPECT_EQ(welcome.value().identity, "anna");
}

TEST(Handshake, AClientSendsHelloAndLoginAtOnceAndThenWaits) {
  auto client = options(false);
  client.session = token(kSession);
  Script script(client);
  const auto first = script.link.next_packet(now_ms(0));
  const auto second = script.link.next_packet(now_ms(0));
  ASSERT_TRUE(first && second);
  EXPECT_EQ(script.sent(), "");
  const auto hello = decode_hello(joined(*first));
  const auto login = decode_login(joined(*second));
  ASSERT_TRUE(hello && login);
  EXPECT_EQ(hello.value().side, token(kOwn));
  EXPECT_EQ(hello.value().session, token(kSession));
  EXPECT_EQ(hello.value().node, "/own");
  EXPECT_EQ(login.value().method, "token");
  EXPECT_EQ(login.value().credential, (Bytes{'p', 'w'}));
}

TEST(Handshake, AClientIsOpenWithTheWelcome) {
  Script script(false);
  auto welcome = a_welcome();
  welcome.message_bytes_max = 1000;
  EXPECT_EQ(script.binary(encode(welcome)), "open");
  EXPECT_EQ(script.link.peer().side, token(kPeer));
  EXPECT_EQ(script.link.peer().session, token(kSession));
  EXPECT_EQ(script.link.peer().node, "/peer");
  EXPECT_EQ(script.link.peer().message_bytes_max, 1000U);
}

TEST(Handshake, ALimitThatWasNotToldIs64MiB) {
  EXPECT_EQ(open_client().link.peer().message_bytes_max, 64U << 20);
  EXPECT_EQ(open_server().link.peer().message_bytes_max, 64U << 20);
}

// Each row: what comes, and what follows in each state.
TEST(Handshake, EveryStateTakesItsOwnPacketsOnly) {
  const Bytes frames = bytes_of(TimeRequest{5});
  const struct {
    const char* what;
    Bytes packet;
    const char *await_hello, *await_login, *authenticating, *await_welcome, *open;
  } rows[] = {
      {"hello", hello(), "-", "failed 4002", "failed 4009", "failed 4002", "failed 4002"},
      {"login", login(), "failed 4002", "ask token", "failed 4009", "failed 4002", "failed 4002"},
      {"welcome", encode(a_welcome()), "failed 4002", "failed 4002", "failed 4009", "open",
       "failed 4002"},
      {"frames", frames, "failed 4002", "failed 4002", "failed 4009", "failed 4002", "-"},
      {"nothing", {}, "failed 4002", "failed 4002", "failed 4009", "failed 4002", "-"},
      {"too much", Bytes(4097, 'R'), "failed 4006", "failed 4006", "failed 4009", "failed 4006",
       "failed 4002"},
  };
  for (const auto& row : rows) {
    SCOPED_TRACE(row.what);
    EXPECT_EQ(Script(true).binary(row.packet), row.await_hello);
    EXPECT_EQ(await_login().binary(row.packet), row.await_login);
    EXPECT_EQ(authenticating().binary(row.packet), row.authenticating);
    EXPECT_EQ(Script(false).binary(row.packet), row.await_welcome);
    EXPECT_EQ(open_server().binary(row.packet), row.open);
    EXPECT_EQ(open_client().binary(row.packet), row.open);
  }
}

TEST(Handshake, TextIsLegalInStateOpenOnly) {
  const std::string demand = R"({"type":"demand","channels":[{"channel":1,"number":1}]})";
  EXPECT_EQ(Script(true).text(demand), "failed 4009");
  EXPECT_EQ(await_login().text(demand), "failed 4009");
  EXPECT_EQ(authenticating().text(demand), "failed 4009");
  EXPECT_EQ(Script(false).text(demand), "failed 4009");
  EXPECT_EQ(open_server().text(demand), "control");
  EXPECT_EQ(open_client().text(demand), "control");
  EXPECT_EQ(open_client().text("{"), "failed 4002");
  EXPECT_EQ(open_client().text(R"({"type":"hello"})"), "failed 4002");
}

TEST(Handshake, AClosedLinkIgnoresAllAndSaysNothing) {
  auto script = open_server();
  EXPECT_EQ(script.pass(0), "-");  // a time request waits
  EXPECT_EQ(script.text("{"), "failed 4002");
  EXPECT_EQ(script.link.state(), State::kClosed);
  EXPECT_EQ(script.text("{"), "-");
  EXPECT_EQ(script.binary({99}), "-");
  EXPECT_EQ(script.authenticated(), "-");
  EXPECT_EQ(script.send("{}"), "-");
  EXPECT_EQ(script.pass(60'000), "-");
  EXPECT_EQ(script.sent(), "");
  EXPECT_FALSE(script.link.deadline());
}

TEST(Handshake, AnAnswerToTheLoginThatNobodyAskedForIsIgnored) {
  Script script(true);
  EXPECT_EQ(script.authenticated(), "-");
  EXPECT_EQ(script.sent(), "");
  EXPECT_EQ(script.link.state(), State::kAwaitHello);
}

TEST(Handshake, VersionsThatDoNotMeet) {
  const auto with = [](std::uint16_t min, std::uint16_t max) {
    return encode(Hello{min, max, token(kPeer), {}, "/peer"});
  };
  EXPECT_EQ(Script(true).binary(with(1, 7)), "-");
  EXPECT_EQ(Script(true).binary(with(2, 7)), "failed 4001");
  auto welcome = a_welcome();
  welcome.version = 2;
  EXPECT_EQ(Script(false).binary(encode(welcome)), "failed 4001");
}

TEST(Handshake, ASideThatReachesItselfCloses) {
  EXPECT_EQ(Script(true).binary(hello(kOwn)), "failed 4011");
  EXPECT_EQ(Script(false).binary(encode(a_welcome(kOwn))), "failed 4011");
}

TEST(Handshake, ALoginHasFiveSecondsInEveryState) {
  Script scripts[] = {Script(true), await_login(), authenticating(), Script(false)};
  for (auto& slow : scripts) {
    EXPECT_EQ(slow.link.deadline(), now_ms(5000).steady);
    EXPECT_EQ(slow.pass(4999), "-");
    EXPECT_EQ(slow.pass(5000), "failed 4004");
    EXPECT_EQ(slow.link.state(), State::kClosed);
  }
}

TEST(Handshake, ALoginThatThinksForLongMakesNoSilentLink) {
  auto script = authenticating();
  EXPECT_EQ(script.pass(4900), "-");
  EXPECT_EQ(script.authenticated(), "open");
  EXPECT_EQ(script.pass(7899), "-");
  EXPECT_EQ(script.pass(7900), "failed 4008");
}

}  // namespace
}  // namespace connect_bridge::link_test
