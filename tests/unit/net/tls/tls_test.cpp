#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "net/tls/tls.hpp"
#include "net/websocket/dial.hpp"
#include "net/websocket/websocket.hpp"
#include "unit/net/tls/certificates.hpp"
#include "unit/net/tls/raw_tls.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

using testing::Contains;
using testing::HasSubstr;

class Tls : public testing::Test {
 protected:
  static Authority& authority() {
    static Authority made{scratch_folder()};
    return made;
  }
  static Authority::Files good() { return authority().sign("robot", "IP:127.0.0.1,DNS:robot"); }

  static ListenOptions server_of(const Authority::Files& files) {
    ListenOptions options;
    options.tls = TlsOptions{files.certificate, files.key};
    return options;
  }

  static DialOptions trusting(const Pair& pair) {
    DialOptions options = pair.dial_options("wss");
    options.tls.ca_file = authority().ca;
    return options;
  }

  // The failure of a client that dials a server with this certificate.
  static Failure failure(const Authority::Files& files) {
    Pair pair{server_of(files)};
    EXPECT_EQ(pair.problem, "");
    EXPECT_FALSE(pair.connect(trusting(pair)));
    EXPECT_TRUE(pair.server.opened.empty());
    return {pair.client.causes[kDial], pair.client.failures[kDial]};
  }
};

// A handshake costs the loop a signature. Of the loopback 8 times as many.
TEST_F(Tls, HandshakesOfAnAddressAreLimited) {
  ListenOptions options = server_of(good());
  options.address_handshakes_at_once = 1;
  options.address_handshake_period = 800s;
  Pair pair{options};
  pair.server.packet_bytes_max = 0;  // nobody logs in
  for (std::uint64_t i = 1; i <= 8; ++i)
    EXPECT_TRUE(pair.connect(trusting(pair), ConnectionId{i})) << i;
  EXPECT_FALSE(pair.connect(trusting(pair), ConnectionId{9}));
  EXPECT_EQ(pair.server.network.counts().handshakes_dropped, 1U);
  EXPECT_THAT(pair.server.logs, Contains(HasSubstr("begins too many TLS handshakes")));
}

// Many connect from the address of a mobile network's NAT.
TEST_F(Tls, WhoSaysNothingTakesNoHandshakeOfItsAddress) {
  ListenOptions options = server_of(good());
  options.address_handshakes_at_once = 1;
  options.address_handshake_period = 800s;
  Pair pair{options};
  for (int i = 0; i < 50; ++i) {
    RawPeer silent(pair.server.network.listen_port());
    pair.loop.run_for(1ms);
  }
  std::vector<std::unique_ptr<RawPeer>> silent;
  for (int i = 0; i < 50; ++i)
    silent.push_back(std::make_unique<RawPeer>(pair.server.network.listen_port()));
  EXPECT_TRUE(pair.connect(trusting(pair)));
  EXPECT_EQ(pair.server.network.counts().handshakes_dropped, 0U);
}

TEST_F(Tls, HandshakesAreKeptForAnAddressWithALoginLately) {
  for (const bool logs_in : {false, true}) {
    ListenOptions options = server_of(good());
    options.address_handshakes_at_once = 1;
    options.address_handshake_period = 800s;
    Pair pair{options};
    if (!logs_in) pair.server.packet_bytes_max = 0;
    ASSERT_TRUE(pair.connect(trusting(pair), ConnectionId{1}));
    for (int i = 0; i < 7; ++i) {
      RawPeer other(pair.server.network.listen_port());
      other.send("\x16");
      pair.loop.run_for(5ms);
    }
    EXPECT_EQ(pair.server.network.counts().handshakes_dropped, 0U);
    Side other(pair.loop);  // has no word of a login
    other.network.dial(kDial, trusting(pair));
    ASSERT_TRUE(pair.loop.until([&] { return !other.opened.empty() || other.failure_count > 0; }));
    EXPECT_EQ(!other.opened.empty(), logs_in);
  }
}

// Whatever those do who share its address, and have logged in from there, too.
TEST_F(Tls, HandshakesAreKeptForWhoHasLoggedInBefore) {
  ListenOptions options = server_of(good());
  options.address_handshakes_at_once = 1;  // of the loopback 8 times as many
  options.address_handshake_period = 800s;
  Pair pair{options};
  ASSERT_TRUE(pair.connect(trusting(pair), ConnectionId{1}));
  Side stranger(pair.loop), late(pair.loop);
  stranger.packet_bytes_max = 0;  // was not welcomed
  stranger.network.dial(ConnectionId{1}, trusting(pair));
  ASSERT_TRUE(pair.loop.until([&] { return stranger.opened.size() == 1; }));
  while (pair.server.network.counts().handshakes_dropped == 0) {
    RawPeer other(pair.server.network.listen_port());
    other.send("\x16");
    pair.loop.run_for(5ms);
  }
  for (Side* const without : {&stranger, &late}) {
    without->network.dial(ConnectionId{2}, trusting(pair));
    ASSERT_TRUE(pair.loop.until([&] { return without->failure_count == 1; }));
  }
  for (std::uint64_t id = 2; id <= 9; ++id)
    EXPECT_TRUE(pair.connect(trusting(pair), ConnectionId{id})) << id;
  EXPECT_FALSE(pair.connect(trusting(pair), ConnectionId{10})) << "more than an address may";
}

// An older server's kind of answer, and that of what ends TLS before a server.
TEST_F(Tls, AnAnswerToTheWordsOfAClientIsFine) {
  std::string problem;
  const Authority::Files files = good();
  const TlsContext context = make_server_tls(TlsOptions{files.certificate, files.key}, problem);
  ASSERT_TRUE(context) << problem;
  SSL_CTX* const server = context->native_handle();
  SSL_CTX_set_alpn_select_cb(
      server,
      [](SSL*, const unsigned char** chosen, unsigned char* size, const unsigned char* offered,
         unsigned bytes, void*) {
        static constexpr unsigned char kKnown[] = "\x02h2\x08http/1.1";
        unsigned char* found = nullptr;
        const int selected =
            SSL_select_next_proto(&found, size, kKnown, sizeof kKnown - 1, offered, bytes);
        *chosen = found;
        return selected == OPENSSL_NPN_NEGOTIATED ? SSL_TLSEXT_ERR_OK : SSL_TLSEXT_ERR_ALERT_FATAL;
      },
      nullptr);
  Loop loop;
  asio::ip::tcp::acceptor door(loop.io, {asio::ip::make_address("127.0.0.1"), 0});
  bool shaken = false;
  std::unique_ptr<Transport> there;
  door.async_accept(loop.io.get_executor(), [&](ErrorCode, TcpSocket socket) {
    there = std::make_unique<Transport>(std::move(socket));
    there->start_tls(context);
    there->async_tls_handshake(true, [&](ErrorCode error) { shaken = !error; });
  });
  DialOptions options;
  options.url = {true, "127.0.0.1", door.local_endpoint().port(), "/"};
  options.tls.ca_file = authority().ca;
  const auto dial = std::make_shared<Dialing>(loop.io, options, SocketOptions{},
                                              make_client_tls(options.tls, problem));
  dial->show({std::string(64, 'a')});
  dial->start([](std::shared_ptr<WebSocket>, const Failure&) {});
  EXPECT_TRUE(loop.until([&] { return shaken; }));
  dial->abandon();
  there->abort();
  loop.run_for(1ms);
}

TEST_F(Tls, HandshakesOfAllAreSpreadOverTime) {
  ListenOptions options = server_of(good());
  options.handshakes_at_once = 2;
  options.handshake_period = 600ms;  // much longer than a handshake takes
  Pair pair{options};
  const auto begin = std::chrono::steady_clock::now();
  for (std::uint64_t i = 1; i <= 4; ++i)
    EXPECT_TRUE(pair.connect(trusting(pair), ConnectionId{i})) << i;
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 1200ms);
  EXPECT_EQ(pair.server.network.counts().handshakes_waited, 2U);
  EXPECT_THAT(pair.server.logs, Contains(HasSubstr("TLS handshakes wait for their turn")));
}

// They are accepted all the same: in the kernel's queue others would stand behind them.
TEST_F(Tls, WhoseHandshakesWaitDoesNotHoldUpOthers) {
  ListenOptions options = server_of(good());
  options.handshakes_at_once = 1;
  options.handshake_period = 300ms;
  Pair pair{options};
  std::vector<std::unique_ptr<RawPeer>> crowd;
  for (int i = 0; i < 12; ++i)
    crowd.push_back(std::make_unique<RawPeer>(pair.server.network.listen_port()));
  const auto begin = std::chrono::steady_clock::now();
  RawTls other(
      pair.server.network.listen_port(), [](SSL_CTX*) {}, "127.0.0.2");
  EXPECT_TRUE(other.shakes(pair.loop));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 2s) << "all of them take 3.6 s";
}

// OpenSSL would handle them for ever without a word.
TEST_F(Tls, WhoAsksForNewKeysWithoutEndIsCutOff) {
  Pair pair{server_of(good())};
  RawTls peer(pair.server.network.listen_port(), [](SSL_CTX*) {});
  ASSERT_TRUE(peer.shakes(pair.loop));
  const auto renew = [&] {
    SSL_key_update(peer.tls(), SSL_KEY_UPDATE_REQUESTED);
    return peer.completes(pair.loop, [&] { return SSL_do_handshake(peer.tls()); });
  };
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(renew());
  const std::string request = upgrade_request();
  ASSERT_TRUE(peer.completes(pair.loop, [&] {
    return SSL_write(peer.tls(), request.data(), static_cast<int>(request.size()));
  }));
  ASSERT_TRUE(pair.loop.until([&] { return !pair.server.opened.empty(); }));
  for (int i = 0; i < 100; ++i) static_cast<void>(renew());
  EXPECT_TRUE(pair.loop.until([&] { return pair.server.is_closed(pair.accepted()); }));
  EXPECT_THAT(pair.server.closed[pair.accepted()].reason, HasSubstr("Protocol error"));
}

TEST_F(Tls, CarriesPacketsBothWays) {
  Pair pair{server_of(good())};
  pair.server.echo = true;
  ASSERT_EQ(pair.problem, "");
  ASSERT_TRUE(pair.connect(trusting(pair))) << pair.client.failures[kDial];
  pair.server.network.allow(pair.accepted(), 32U << 20U);
  pair.client.network.allow(kDial, 32U << 20U);
  const std::string large(20U << 20U, 'x');
  for (int i = 0; i < 100; ++i) pair.client.send(kDial, std::to_string(i), true);
  pair.client.send(kDial, large);
  ASSERT_TRUE(pair.loop.until([&] { return pair.client.packets(kDial) == 101; }, 20s));
  EXPECT_EQ(text_of(pair.client.received[kDial][99].payload), "99");
  EXPECT_EQ(text_of(pair.client.received[kDial][100].payload), large);
  pair.client.network.close(kDial, CloseCode::kGoingAway, "bye");
  ASSERT_TRUE(pair.loop.until(
      [&] { return pair.client.is_closed(kDial) && pair.server.is_closed(pair.accepted()); }));
  EXPECT_EQ(pair.server.closed[pair.accepted()].code, 1001);
  pair.loop.io.restart();
  pair.server.network.stop();
  pair.client.network.stop();  // it watches the machine's routes since it has dialed
  pair.loop.io.run_for(1500ms);
  EXPECT_TRUE(pair.loop.io.stopped());
}

TEST_F(Tls, ChecksTheName) {
  const Failure why = failure(authority().sign("other", "DNS:robot,IP:127.0.0.2"));
  EXPECT_EQ(why.cause, Cause::kCertificateName);
  EXPECT_THAT(why.text, HasSubstr("not for '127.0.0.1'"));
  Pair pair{server_of(authority().sign("named", "DNS:robot"))};
  DialOptions options = trusting(pair);
  options.url.robot = "robot";
  EXPECT_TRUE(pair.connect(options));
  options.url.robot = "robots";
  EXPECT_FALSE(pair.connect(options, {78}));
  EXPECT_EQ(pair.client.causes[{78}], Cause::kCertificateName);
  EXPECT_THAT(pair.client.failures[{78}], HasSubstr("not for 'robots'"));
}

TEST_F(Tls, AWildcardIsAWholeWordOfAName) {
  Pair pair{server_of(authority().sign("wild", "DNS:*.example.org,DNS:rob*.example.net"))};
  DialOptions options = trusting(pair);
  options.url.robot = "robot.example.org";
  EXPECT_TRUE(pair.connect(options));
  options.url.robot = "robot.example.net";
  EXPECT_FALSE(pair.connect(options, {78}));
  EXPECT_THAT(pair.client.failures[{78}], HasSubstr("not for 'robot.example.net'"));
}

TEST_F(Tls, ChecksTheAuthorityAndTheDates) {
  EXPECT_EQ(failure(authority().sign("old", "IP:127.0.0.1", -10, -1)).cause,
            Cause::kCertificateExpired);
  EXPECT_EQ(failure(authority().sign("new", "IP:127.0.0.1", 1, 9)).cause, Cause::kCertificateEarly);
  Pair pair{server_of(good())};
  EXPECT_FALSE(pair.connect(pair.dial_options("wss")));  // the system's store
  EXPECT_EQ(pair.client.causes[kDial], Cause::kCertificateForeign);
  EXPECT_THAT(pair.client.failures[kDial], HasSubstr("issued by 'CN=Test authority'"));
}

// The name is the server's choice.
TEST_F(Tls, TheNameOfAnUnknownIssuerIsTextAndShort) {
  Authority odd{scratch_folder() + "odd_", "a\n\x1b[2J" + std::string(50, 'x')};
  Pair pair{server_of(odd.sign("robot", "IP:127.0.0.1"))};
  EXPECT_FALSE(pair.connect(trusting(pair)));
  const std::string& text = pair.client.failures[kDial];
  EXPECT_THAT(text, HasSubstr("issued by 'CN=a\\0A\\1B[2Jxxx"));
  EXPECT_EQ(text.find_first_of("\n\x1b"), std::string::npos);
}

TEST_F(Tls, RefusesOldVersions) {
  Pair pair{server_of(good())};
  RawPeer peer(pair.server.network.listen_port());
  // The start of a TLS 1.0 hello without the extension for newer versions.
  std::string hello("\x16\x03\x01\0\x2d\x01\0\0\x29\x03\x01", 11);
  hello += std::string(32, 'r') + std::string("\0\0\2\xc0\x13\1\0", 7);
  peer.send(hello);
  EXPECT_TRUE(peer.ends(pair.loop));
  EXPECT_TRUE(pair.server.opened.empty());
}

TEST_F(Tls, TellsPlainClientsAndServersApart) {
  Pair tls{server_of(good())};
  EXPECT_FALSE(tls.connect(tls.dial_options("ws")));
  EXPECT_EQ(tls.client.causes[kDial], Cause::kPlainToTlsPort);
  EXPECT_THAT(tls.client.failures[kDial], HasSubstr("use wss://"));
  Pair plain;
  EXPECT_FALSE(plain.connect(trusting(plain)));
  EXPECT_EQ(plain.client.causes[kDial], Cause::kTlsToPlainPort);
}

TEST_F(Tls, WantsClientCertificatesIfAskedTo) {
  ListenOptions options = server_of(good());
  options.tls->ca_file = authority().ca;
  Pair pair{options};
  DialOptions dial = trusting(pair);
  EXPECT_FALSE(pair.connect(dial));
  EXPECT_EQ(pair.client.causes[kDial], Cause::kClientCertificate);
  const auto own = authority().sign("operator", "DNS:operator");
  dial.tls.certificate_file = own.certificate;
  dial.tls.private_key_file = own.key;
  EXPECT_TRUE(pair.connect(dial, {78})) << pair.client.failures[{78}];
  Authority stranger{scratch_folder() + "stranger_", "Stranger"};
  const auto strange = stranger.sign("operator", "DNS:operator");
  dial.tls.certificate_file = strange.certificate;
  dial.tls.private_key_file = strange.key;
  EXPECT_FALSE(pair.connect(dial, {79}));
  EXPECT_EQ(pair.client.causes[{79}], Cause::kClientCertificate);
}

TEST_F(Tls, NamesTheFileThatIsWrong) {
  const auto files = good();
  const auto other = authority().sign("another", "DNS:another");
  const std::string garbage = scratch_folder() + "garbage.pem";
  std::ofstream{garbage} << "-----BEGIN NOTHING-----\n";
  const auto problem = [](const std::string& certificate, const std::string& key) {
    return Pair{server_of({certificate, key})}.problem;
  };
  EXPECT_THAT(problem("/nowhere/c.pem", files.key),
              HasSubstr("certificate '/nowhere/c.pem' cannot be read: No such file"));
  EXPECT_THAT(problem(files.certificate, "/nowhere/k.pem"),
              HasSubstr("private key '/nowhere/k.pem' cannot be read"));
  EXPECT_THAT(problem(garbage, files.key), HasSubstr(garbage));
  EXPECT_THAT(problem(files.certificate, garbage), HasSubstr("not a PEM key"));
  EXPECT_THAT(problem(files.certificate, other.key), HasSubstr("does not belong to"));
  Pair pair;
  DialOptions dial = pair.dial_options("wss");
  dial.tls.ca_file = "/nowhere/ca.pem";
  EXPECT_FALSE(pair.connect(dial));
  EXPECT_EQ(pair.client.causes[kDial], Cause::kCertificateFiles);
  EXPECT_THAT(pair.client.failures[kDial], HasSubstr("CA file '/nowhere/ca.pem' cannot be read"));
}

TEST_F(Tls, SlowHandshakesAreCut) {
  ListenOptions options = server_of(good());
  options.handshake_timeout = 200ms;
  Pair pair{options};
  RawPeer silent(pair.server.network.listen_port());
  RawPeer half(pair.server.network.listen_port());
  half.send("\x16\x03\x01");
  EXPECT_TRUE(silent.ends(pair.loop, 400ms));
  EXPECT_TRUE(half.ends(pair.loop, 400ms));
}

TEST_F(Tls, WhoWaitsForATurnIsCutInTime) {
  ListenOptions options = server_of(good());
  options.handshakes_at_once = 1;
  options.handshake_period = 800s;
  options.handshake_timeout = 50ms;  // and four times that for a turn
  Pair pair{options};
  RawPeer first(pair.server.network.listen_port());
  first.send("\x16");
  ASSERT_TRUE(first.ends(pair.loop, 2s));
  RawPeer second(pair.server.network.listen_port());
  second.send("\x16");
  EXPECT_TRUE(second.ends(pair.loop, 2s));
  EXPECT_EQ(pair.server.network.counts().handshakes_waited, 1U);
}

TEST_F(Tls, APeerThatDoesNotReadIsCutAfterASecond) {
  Pair pair{server_of(good())};
  ASSERT_TRUE(pair.connect(trusting(pair)));
  // The client has one packet that is never read.
  pair.client.packet_bytes_max = 0;
  pair.client.reads = false;
  const ConnectionId second{78};
  ASSERT_TRUE(pair.connect(trusting(pair), second));
  const ConnectionId id = pair.accepted();
  pair.server.send(id, "one");
  pair.server.send(id, std::string(30U << 20U, 'x'));
  pair.loop.run_for(100ms);
  pair.server.network.close(id, CloseCode::kSlowPeer, "slow");
  EXPECT_TRUE(pair.loop.until([&] { return pair.server.is_closed(id); }, 1300ms));
}

}  // namespace
}  // namespace connect_bridge::test
