#include <gtest/gtest.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <optional>

#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

TEST(Network, CarriesTextAndBinaryBothWays) {
  Pair pair;
  ASSERT_EQ(pair.problem, "");
  ASSERT_TRUE(pair.connect());
  pair.client.send(kDial, "{\"hello\":1}", true);
  pair.client.send(kDial, std::string_view{"\0\1\2", 3});
  pair.server.send(pair.accepted(), "");
  pair.server.send(pair.accepted(), "from the server");
  ASSERT_TRUE(pair.loop.until([&] {
    return pair.server.packets(pair.accepted()) == 2 && pair.client.packets(kDial) == 2;
  }));
  const auto& at_server = pair.server.received[pair.accepted()];
  EXPECT_TRUE(at_server[0].text);
  EXPECT_EQ(text_of(at_server[0].payload), "{\"hello\":1}");
  EXPECT_FALSE(at_server[1].text);
  EXPECT_EQ(at_server[1].payload.size(), 3U);
  EXPECT_EQ(text_of(pair.client.received[kDial][0].payload), "");
  EXPECT_EQ(text_of(pair.client.received[kDial][1].payload), "from the server");
  EXPECT_EQ(pair.server.peers[pair.accepted()].substr(0, 10), "127.0.0.1:");
}

TEST(Network, SendsThePiecesOfAPacketAsOneMessage) {
  Pair pair;
  ASSERT_TRUE(pair.connect());
  const std::string large(100'000, 'x');
  Packet few{false, {Payload::adopt(bytes_of("head ")), Payload::adopt(bytes_of(large))}};
  Packet many;
  for (int i = 0; i < 300; ++i) many.pieces.push_back(Payload::adopt(bytes_of("abc")));
  for (Side* side : {&pair.client, &pair.server}) {
    const ConnectionId id = side == &pair.client ? kDial : pair.accepted();
    side->send(id, few);
    side->send(id, many);
  }
  ASSERT_TRUE(pair.loop.until([&] {
    return pair.server.packets(pair.accepted()) == 2 && pair.client.packets(kDial) == 2;
  }));
  for (const auto& received :
       {pair.server.received[pair.accepted()], pair.client.received[kDial]}) {
    EXPECT_EQ(text_of(received[0].payload), "head " + large);
    EXPECT_EQ(received[1].payload.size(), 900U);
    EXPECT_EQ(text_of(received[1].payload).substr(0, 6), "abcabc");
  }
}

TEST(Network, EchoesManyMessagesInOrder) {
  Pair pair;
  pair.server.echo = true;
  ASSERT_TRUE(pair.connect());
  constexpr std::size_t kCount = 5000;
  for (std::size_t i = 0; i < kCount; ++i) pair.client.send(kDial, std::to_string(i));
  ASSERT_TRUE(pair.loop.until([&] { return pair.client.packets(kDial) == kCount; }, 20s));
  for (std::size_t i = 0; i < kCount; ++i) {
    ASSERT_EQ(text_of(pair.client.received[kDial][i].payload), std::to_string(i));
  }
}

TEST(Network, CarriesAMessageOf64MiB) {
  Pair pair;
  pair.server.echo = true;
  pair.server.packet_bytes_max = pair.client.packet_bytes_max = 64U << 20U;
  ASSERT_TRUE(pair.connect());
  Bytes large(64U << 20U);
  for (std::size_t i = 0; i < large.size(); i += 997) large[i] = static_cast<std::uint8_t>(i >> 3U);
  const Payload payload = Payload::adopt(std::move(large));
  pair.client.send(kDial, Packet{false, {payload}});
  ASSERT_TRUE(pair.loop.until([&] { return pair.client.packets(kDial) == 1; }, 60s));
  const Payload& back = pair.client.received[kDial][0].payload;
  EXPECT_TRUE(std::equal(back.view().begin(), back.view().end(), payload.view().begin(),
                         payload.view().end()));
}

TEST(Network, TakesLittleBehindTheGate) {
  Pair pair;
  pair.server.packet_bytes_max = 0;
  ASSERT_TRUE(pair.connect());
  pair.client.send(kDial, std::string(4096, 'a'));
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.packets(pair.accepted()) == 1; }));
  pair.client.send(kDial, std::string(4097, 'a'));
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.is_closed(pair.accepted()); }));
  EXPECT_NE(pair.server.closed[pair.accepted()].reason.find("too large for a login"),
            std::string::npos);
  ASSERT_TRUE(pair.loop.until([&] { return pair.client.is_closed(kDial); }));
  EXPECT_EQ(pair.client.closed[kDial].code, 1009);
  EXPECT_EQ(pair.server.packets(pair.accepted()), 1U);
}

TEST(Network, TakesFewPacketsBehindTheGate) {
  Pair pair;
  pair.server.packet_bytes_max = 0;
  ASSERT_TRUE(pair.connect());
  for (int i = 0; i < 5000; ++i) pair.client.send(kDial, "");
  ASSERT_TRUE(pair.loop.until(
      [&] { return pair.client.is_closed(kDial) && pair.server.is_closed(pair.accepted()); }));
  EXPECT_EQ(pair.client.closed[kDial].code, 4006);
  EXPECT_LE(pair.server.packets(pair.accepted()), 2048U);
  EXPECT_NE(pair.server.closed[pair.accepted()].reason.find("before the login"), std::string::npos);
}

TEST(Network, ReadsNothingBehindAPacketThatWaits) {
  Pair pair;
  pair.server.packet_bytes_max = 0;
  pair.server.reads = false;
  ASSERT_TRUE(pair.connect());
  pair.client.send(kDial, "hello");
  pair.client.send(kDial, std::string(50'000, 'x'));
  pair.loop.run_for(100ms);
  EXPECT_EQ(pair.server.packets(pair.accepted()), 1U);
  pair.server.network.allow(pair.accepted(), 50'000);
  pair.server.network.read_on(pair.accepted());
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.packets(pair.accepted()) == 2; }));
}

TEST(Network, EndsAConnectionWithAPacketBeyondTheLimit) {
  Pair pair;
  pair.server.packet_bytes_max = 1000;
  ASSERT_TRUE(pair.connect());
  pair.client.send(kDial, std::string(1001, 'x'));
  ASSERT_TRUE(pair.loop.until([&] { return pair.client.is_closed(kDial); }));
  EXPECT_EQ(pair.client.closed[kDial].code, 1009);
}

TEST(Network, TellsTheServersCloseCodeAndReason) {
  Pair pair;
  ASSERT_TRUE(pair.connect());
  pair.server.network.close(pair.accepted(), CloseCode::kLoginRefused, "wrong token");
  ASSERT_TRUE(pair.loop.until(
      [&] { return pair.client.is_closed(kDial) && pair.server.is_closed(pair.accepted()); }));
  EXPECT_EQ(pair.client.closed[kDial].code, 4003);
  EXPECT_EQ(pair.client.closed[kDial].reason, "wrong token");
  pair.loop.run_for(50ms);
  EXPECT_EQ(pair.client.closed_count, 1U);
  EXPECT_EQ(pair.server.closed_count, 1U);
}

TEST(Network, CountsWhatAConnectionHasCostAlsoWhenItIsCutOff) {
  Pair pair;
  RawPeer mute(pair.server.network.listen_port());
  mute.send(upgrade_request());
  ASSERT_TRUE(mute.sees(pair.loop, "101 Switching"));
  ASSERT_TRUE(pair.loop.until([&] { return !pair.server.opened.empty(); }));
  const Traffic open = pair.server.network.traffic();
  EXPECT_GT(open.received, upgrade_request().size());
  EXPECT_GT(pair.server.network.tcp_counts(pair.accepted()).segments, 0U);
  EXPECT_EQ(pair.server.network.tcp_counts(kDial).segments, 0U);             // not here
  pair.server.network.close(pair.accepted(), CloseCode::kLoginRefused, "");  // it does not answer
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.closed_count == 1; }));
  const Traffic closed = pair.server.network.traffic();
  EXPECT_GE(closed.received, open.received);
  EXPECT_GT(closed.sent, open.sent);
}

// Each of them may cost a client kilobytes, which its provider bills.
TEST(Network, CountsWhatAFailedDialHasCost) {
  Pair pair;
  namespace asio = boost::asio;
  asio::ip::tcp::acceptor other(pair.loop.io, {asio::ip::make_address("127.0.0.1"), 0});
  const std::string answer = "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n";
  std::optional<asio::ip::tcp::socket> there;
  other.async_accept([&](const auto&, asio::ip::tcp::socket socket) {
    there.emplace(std::move(socket));
    there->send(asio::buffer(answer));
  });
  DialOptions dial = pair.dial_options();
  dial.url.port = other.local_endpoint().port();
  EXPECT_FALSE(pair.connect(dial));
  const Traffic traffic = pair.client.network.traffic();
  EXPECT_GT(traffic.received, answer.size());
  EXPECT_GT(traffic.sent, 100U) << "the request";
}

TEST(Network, TellsTheClientsCloseCodeAfterWhatWasPulled) {
  Pair pair;
  ASSERT_TRUE(pair.connect());
  pair.client.send(kDial, std::string(500'000, 'x'));
  pair.client.network.close(kDial, CloseCode::kGoingAway, "bye");
  ASSERT_TRUE(pair.loop.until(
      [&] { return pair.client.is_closed(kDial) && pair.server.is_closed(pair.accepted()); }));
  EXPECT_EQ(pair.server.packets(pair.accepted()), 1U);
  EXPECT_EQ(pair.server.closed[pair.accepted()].code, 1001);
  EXPECT_EQ(pair.server.closed[pair.accepted()].reason, "bye");
}

TEST(Network, CutsALongReasonBetweenCharacters) {
  Pair pair;
  ASSERT_TRUE(pair.connect());
  std::string reason(119, 'a');
  for (int i = 0; i < 20; ++i) reason += "ü";  // two bytes: 120 would cut one in half
  pair.server.network.close(pair.accepted(), CloseCode::kInternal, reason);
  ASSERT_TRUE(pair.loop.until([&] { return pair.client.is_closed(kDial); }));
  EXPECT_EQ(pair.client.closed[kDial].reason, std::string(119, 'a'));
}

TEST(Network, DeliversNothingAfterClose) {
  Pair pair;
  ASSERT_TRUE(pair.connect());
  for (int i = 0; i < 100; ++i) pair.client.send(kDial, std::string(10'000, 'x'));
  pair.server.network.close(pair.accepted(), CloseCode::kNormal, "");
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.is_closed(pair.accepted()); }));
  EXPECT_EQ(pair.server.packets(pair.accepted()), 0U);
}

TEST(Network, BothSidesMayCloseAtOnce) {
  Pair pair;
  ASSERT_TRUE(pair.connect());
  pair.server.network.close(pair.accepted(), CloseCode::kNormal, "server");
  pair.client.network.close(kDial, CloseCode::kNormal, "client");
  ASSERT_TRUE(pair.loop.until(
      [&] { return pair.client.is_closed(kDial) && pair.server.is_closed(pair.accepted()); }));
  pair.loop.run_for(50ms);
  EXPECT_EQ(pair.client.closed_count + pair.server.closed_count, 2U);
}

TEST(Network, ServesFiftyConnectionsAtOnce) {
  ListenOptions options;
  options.pending_per_address_max = 50;
  Pair pair{options};
  pair.server.echo = true;
  std::vector<ConnectionId> ids;
  for (std::uint32_t i = 1; i <= 50; ++i) ids.push_back({1000 + i});
  for (const auto id : ids) pair.client.network.dial(id, pair.dial_options());
  ASSERT_TRUE(pair.loop.until([&] { return pair.client.opened.size() == 50; }, 20s));
  for (int round = 0; round < 20; ++round) {
    for (const auto id : ids) pair.client.send(id, std::string(1000, 'r'));
  }
  ASSERT_TRUE(
      pair.loop.until([&] { return pair.client.received_bytes == 50U * 20U * 1000U; }, 20s));
  EXPECT_EQ(pair.server.network.counts().open, 50U);
  pair.server.network.stop();
  ASSERT_TRUE(pair.loop.until([&] { return pair.client.closed_count == 50; }));
}

TEST(Network, StopsWithinASecondAndLeavesNothingToDo) {
  Pair pair;
  ASSERT_TRUE(pair.connect());
  RawPeer mute(pair.server.network.listen_port());
  mute.send(upgrade_request());
  ASSERT_TRUE(mute.sees(pair.loop, "101 Switching"));
  RawPeer idle(pair.server.network.listen_port());
  pair.loop.run_for(50ms);
  const auto begin = std::chrono::steady_clock::now();
  pair.server.network.stop();
  pair.client.network.stop();
  pair.loop.io.restart();
  pair.loop.io.run_for(3s);
  EXPECT_TRUE(pair.loop.io.stopped());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1500ms);
  EXPECT_EQ(pair.server.closed_count, 2U);
  EXPECT_EQ(pair.client.closed_count, 1U);
  EXPECT_EQ(pair.client.closed[kDial].code, 1001);
}

TEST(Network, ReportsWhyItCannotListen) {
  Pair pair;
  Side other(pair.loop);
  ListenOptions options;
  options.port = pair.server.network.listen_port();
  EXPECT_NE(other.network.listen(options).find("Address already in use"), std::string::npos);
  options.addresses = {"robot"};
  EXPECT_NE(other.network.listen(options).find("no IP address"), std::string::npos);
}

TEST(Network, ListensOnIPv6AndIPv4) {
  ListenOptions options;
  options.addresses = {"*"};
  Pair pair{options};
  ASSERT_EQ(pair.problem, "");
  DialOptions dial = pair.dial_options();
  ASSERT_TRUE(pair.connect(dial));
  EXPECT_EQ(pair.server.peers[pair.accepted()].substr(0, 10), "127.0.0.1:");
  dial.url.host = "::1";
  if (pair.connect(dial, {78})) {
    EXPECT_EQ(pair.server.peers[pair.accepted()].substr(0, 6), "[::1]:");
  }
}

TEST(Network, ListensOnSeveralAddressesWithOnePort) {
  ListenOptions options;
  options.addresses = {"127.0.0.1", "127.0.0.2", "::1"};
  Pair pair{options};
  if (pair.problem.find("::1") != std::string::npos || !pair.server.logs.empty())
    GTEST_SKIP() << "no IPv6 here";
  ASSERT_EQ(pair.problem, "");
  DialOptions dial = pair.dial_options();
  const std::string port = ":" + std::to_string(dial.url.port);
  EXPECT_EQ(pair.server.network.listen_addresses(),
            (std::vector<std::string>{"127.0.0.1" + port, "127.0.0.2" + port, "[::1]" + port}));
  for (const std::string& address : options.addresses) {
    dial.url.host = address;
    EXPECT_TRUE(pair.connect(dial, {pair.server.opened.size() + 1})) << address;
  }
  EXPECT_EQ(pair.server.network.counts().accepted, 3U);
}

TEST(Network, ListensOnNoneOfTheAddressesIfOneIsWrong) {
  Pair pair;
  Side other(pair.loop);
  ListenOptions options;
  options.port = pair.server.network.listen_port();
  options.addresses = {"127.0.0.2", "127.0.0.1"};
  const std::string said = other.network.listen(options);
  EXPECT_EQ(said,
            "cannot listen on 127.0.0.1:" + std::to_string(options.port) +
                ": Address already in use (a server that runs already, or another program: end "
                "that, or change listen.port)");
  EXPECT_FALSE(RawPeer(options.port, "127.0.0.2").connected);
}

// As systemd hands them over.
TEST(Network, TakesSocketsThatItIsGiven) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ListenOptions options;
  options.sockets = {socket};
  EXPECT_EQ(Pair{options}.problem, "the socket " + std::to_string(socket) +
                                       " that this process was given does not listen for TCP");
  ASSERT_EQ(::listen(socket, 8), 0);
  Pair pair{options};
  ASSERT_EQ(pair.problem, "");
  EXPECT_TRUE(pair.connect());
  pair.server.network.stop();
  EXPECT_EQ(::fcntl(socket, F_GETFD), -1) << "it stays open";
}

TEST(Dial, ReportsARefusedConnection) {
  Pair pair;
  DialOptions options = pair.dial_options();
  options.url.port = 1;
  EXPECT_FALSE(pair.connect(options));
  EXPECT_EQ(pair.client.causes[kDial], Cause::kPortClosed);
  options.url.robot = "robot";  // at that address is a relay
  EXPECT_FALSE(pair.connect(options, {78}));
  EXPECT_EQ(pair.client.causes[{78}], Cause::kRelayUnreachable);
}

TEST(Dial, ReportsAServerThatIsSilent) {
  Pair pair;
  Loop& loop = pair.loop;
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(::listen(listener, 1), 0);
  ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
  DialOptions options = pair.dial_options();
  options.url.port = ntohs(address.sin_port);
  options.timeout = 200ms;
  pair.client.network.dial(kDial, options);
  EXPECT_TRUE(loop.until([&] { return pair.client.failures.count(kDial) != 0; }, 1s));
  EXPECT_EQ(pair.client.causes[kDial], Cause::kServerSilent);
  ::close(listener);
}

TEST(Dial, CanBeGivenUp) {
  Pair pair;
  pair.client.network.dial(kDial, pair.dial_options());
  pair.client.network.close(kDial, CloseCode::kGoingAway, "stop");
  ASSERT_TRUE(pair.loop.until([&] { return pair.client.failures.count(kDial) != 0; }));
  pair.loop.run_for(50ms);
  EXPECT_EQ(pair.client.failure_count, 1U);
  EXPECT_TRUE(pair.client.opened.empty());
}

// Behind a proxy each robot has a path of its own.
TEST(Dial, AnyPathOpens) {
  Pair pair;
  DialOptions dial = pair.dial_options();
  dial.url.target = "/robot7?x=1";
  EXPECT_TRUE(pair.connect(dial, {78}));
}

}  // namespace
}  // namespace connect_bridge::test
