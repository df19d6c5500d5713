// Foreign peers: browsers, scanners and attackers.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>

#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

ListenOptions quick() {
  ListenOptions options;
  options.handshake_timeout = 300ms;
  return options;
}

// Whether there is such a line in the server's log.
bool was_told(const Pair& pair, const std::string& what) {
  const auto& logs = pair.server.logs;
  return std::any_of(logs.begin(), logs.end(),
                     [&](const std::string& line) { return line.find(what) != std::string::npos; });
}

// The whole answer to a request that ends in a closed connection.
std::string answer(Pair& pair, const std::string& request) {
  RawPeer peer(pair.server.network.listen_port());
  peer.send(request);
  EXPECT_TRUE(peer.ends(pair.loop));
  EXPECT_TRUE(pair.server.opened.empty());
  return peer.text;
}

TEST(Hostile, WrongSubprotocolIsToldTheRightOne) {
  Pair pair{quick()};
  for (const char* offered : {"", "mqtt", "ros2-connect.v1x, foxglove.sdk.v1"}) {
    const std::string text = answer(pair, upgrade_request("", "/", offered));
    EXPECT_EQ(text.substr(0, 12), "HTTP/1.1 400");
    EXPECT_NE(text.find("ros2-connect.v1"), std::string::npos);
  }
}

TEST(Hostile, TheSubprotocolMayBeOneOfSeveral) {
  Pair pair{quick()};
  RawPeer peer(pair.server.network.listen_port());
  peer.send(upgrade_request("", "/", "mqtt, ros2-connect.v1"));
  ASSERT_TRUE(peer.sees(pair.loop, "\r\n\r\n"));
  EXPECT_EQ(peer.text.substr(0, 12), "HTTP/1.1 101");
  EXPECT_NE(peer.text.find("Sec-WebSocket-Protocol: ros2-connect.v1\r\n"), std::string::npos);
}

TEST(Hostile, CompressionIsNotNegotiated) {
  Pair pair{quick()};
  RawPeer peer(pair.server.network.listen_port());
  peer.send(upgrade_request("Sec-WebSocket-Extensions: permessage-deflate\r\n"));
  ASSERT_TRUE(peer.sees(pair.loop, "\r\n\r\n"));
  EXPECT_EQ(peer.text.find("permessage-deflate"), std::string::npos);
}

TEST(Hostile, BrowsersAreHelped) {
  Pair pair{quick()};
  const std::string text = answer(pair, "GET / HTTP/1.1\r\nHost: robot:9090\r\n\r\n");
  EXPECT_EQ(text.substr(0, 12), "HTTP/1.1 426");
  EXPECT_NE(text.find("ros2 run connect_bridge client"), std::string::npos);
  EXPECT_NE(text.find("ws://robot:9090/"), std::string::npos);
}

TEST(Hostile, WrongRequestsAreRefused) {
  Pair pair{quick()};
  EXPECT_EQ(
      answer(pair, "POST / HTTP/1.1\r\nHost: r\r\nContent-Length: 5\r\n\r\nhello").substr(0, 12),
      "HTTP/1.1 405");
  EXPECT_EQ(answer(pair, "\x16\x03\x01garbage\r\n\r\n").substr(0, 12), "HTTP/1.1 400");
  EXPECT_EQ(answer(pair, upgrade_request() + "early").substr(0, 12), "HTTP/1.1 400");
  EXPECT_EQ(answer(pair, upgrade_request("X: " + std::string(20'000, 'x') + "\r\n")).substr(0, 12),
            "HTTP/1.1 431");
  EXPECT_TRUE(pair.loop.until([&] { return pair.server.network.counts().refused == 4; }));
}

TEST(Hostile, WebPagesMayNotConnect) {
  Pair pair{quick()};
  EXPECT_EQ(answer(pair, upgrade_request("Origin: https://evil.example\r\n")).substr(0, 12),
            "HTTP/1.1 403");
}

TEST(Hostile, SlowlorisIsCut) {
  Pair pair{quick()};
  RawPeer silent(pair.server.network.listen_port());
  RawPeer slow(pair.server.network.listen_port());
  const std::string request = upgrade_request();
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < 50 && !slow.ended; ++i) {
    slow.send(request.substr(i, 1));
    pair.loop.run_for(20ms);
    slow.poll();
  }
  EXPECT_TRUE(slow.ended);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 900ms);
  EXPECT_TRUE(silent.ends(pair.loop, 100ms));
  EXPECT_EQ(pair.server.network.counts().pending, 0U);
}

// Of the loopback 8 times as many.
TEST(Hostile, TheOldestHandshakeOfAnAddressGivesWay) {
  ListenOptions options = quick();
  options.handshake_timeout = 5s;
  options.pending_per_address_max = 1;
  Pair pair{options};
  std::vector<std::unique_ptr<RawPeer>> peers;
  for (int i = 0; i < 10; ++i) {
    peers.push_back(std::make_unique<RawPeer>(pair.server.network.listen_port()));
  }
  pair.loop.run_for(50ms);
  EXPECT_EQ(pair.server.network.counts().pending, 8U);
  EXPECT_EQ(pair.server.network.counts().refused, 2U);
  EXPECT_EQ(pair.server.network.counts().gave_way, 2U);
  EXPECT_TRUE(was_told(pair, "its address has too many"));
  EXPECT_TRUE(peers[0]->ends(pair.loop, 100ms));
  EXPECT_TRUE(peers[1]->ends(pair.loop, 100ms));
  EXPECT_TRUE(pair.connect());  // in spite of them
  EXPECT_TRUE(peers[2]->ends(pair.loop, 100ms));
  EXPECT_FALSE(peers[3]->ends(pair.loop, 20ms));
  peers.clear();
  pair.loop.run_for(50ms);
  EXPECT_EQ(pair.server.network.counts().pending, 0U);
}

TEST(Hostile, TheOldestHandshakeOfAllGivesWay) {
  ListenOptions options;
  options.pending_max = 3;
  Pair pair{options};
  std::vector<std::unique_ptr<RawPeer>> peers;
  for (int i = 0; i < 4; ++i)
    peers.push_back(std::make_unique<RawPeer>(pair.server.network.listen_port()));
  EXPECT_TRUE(peers[0]->ends(pair.loop, 1s));
  EXPECT_FALSE(peers[1]->ends(pair.loop, 20ms));
  EXPECT_EQ(pair.server.network.counts().gave_way, 1U);
  EXPECT_TRUE(was_told(pair, "there are too many"));
}

TEST(Hostile, TheOldestConnectionWithoutALoginGivesWay) {
  ListenOptions options;
  options.pending_per_address_max = 1;
  Pair pair{options};
  pair.server.packet_bytes_max = 0;
  std::vector<ConnectionId> accepted;
  for (std::uint64_t i = 1; i <= 8; ++i) {
    ASSERT_TRUE(pair.connect(ConnectionId{i}));
    accepted.push_back(pair.accepted());
  }
  pair.server.network.allow(accepted[0], 1000);  // it has logged in, so its address has 4 times 8
  for (std::uint64_t i = 9; i <= 33; ++i) ASSERT_TRUE(pair.connect(ConnectionId{i}));
  pair.loop.run_for(20ms);
  EXPECT_EQ(pair.server.closed_count, 0U);
  ASSERT_TRUE(pair.connect(ConnectionId{34}));
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.closed_count > 0; }));
  EXPECT_TRUE(pair.server.is_closed(accepted[1]));
  EXPECT_TRUE(pair.loop.until([&] { return pair.client.is_closed({2}); }));
  EXPECT_EQ(pair.server.closed_count, 1U);
}

TEST(Hostile, AStrangerGivesWayWhereAllPlacesAreTaken) {
  ListenOptions options;
  options.connections_max = 2;
  Pair pair{options};
  ASSERT_TRUE(pair.connect(ConnectionId{1}));
  pair.server.packet_bytes_max = 0;
  ASSERT_TRUE(pair.connect(ConnectionId{2}));
  const ConnectionId stranger = pair.accepted();
  EXPECT_TRUE(pair.connect(ConnectionId{3}));
  EXPECT_TRUE(pair.loop.until([&] { return pair.server.is_closed(stranger); }));
}

TEST(Hostile, TooManyConnectionsGet503) {
  ListenOptions options;
  options.connections_max = 2;
  Pair pair{options};
  ASSERT_TRUE(pair.connect(ConnectionId{1}));
  ASSERT_TRUE(pair.connect(ConnectionId{2}));
  EXPECT_FALSE(pair.connect(ConnectionId{3}));
  EXPECT_EQ(pair.client.causes[{3}], Cause::kTooManyConnections);
  pair.client.network.close({1}, CloseCode::kNormal, "");
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.closed_count == 1; }));
  pair.loop.run_for(50ms);
  EXPECT_TRUE(pair.connect(ConnectionId{4}));
}

// As many descriptors as this process may have, from now on.
class DescriptorLimit {
 public:
  explicit DescriptorLimit(rlim_t most) {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    const rlimit fewer{most, before_.rlim_max};
    ::setrlimit(RLIMIT_NOFILE, &fewer);
  }
  ~DescriptorLimit() { ::setrlimit(RLIMIT_NOFILE, &before_); }
  DescriptorLimit(const DescriptorLimit&) = delete;
  DescriptorLimit& operator=(const DescriptorLimit&) = delete;

 private:
  rlimit before_{};
};

// It is tried again ten times a second.
TEST(Hostile, WithoutDescriptorsTheLogStaysShort) {
#if defined(__has_feature)
#if __has_feature(undefined_behavior_sanitizer)
  GTEST_SKIP() << "NOT TESTED under this sanitizer, which opens a pipe to look at an object's type";
#endif
#endif
  Pair pair{quick()};
  RawPeer peer(pair.server.network.listen_port());
  ASSERT_TRUE(peer.connected);
  const int next = ::dup(STDERR_FILENO);  // the lowest that is free
  ::close(next);
  {
    const DescriptorLimit none(static_cast<rlim_t>(next));
    pair.loop.run_for(1s);
  }
  ASSERT_EQ(pair.server.logs.size(), 1U);
  EXPECT_NE(pair.server.logs[0].find("cannot accept connections now"), std::string::npos);
  peer.send(upgrade_request());
  EXPECT_TRUE(peer.sees(pair.loop, "HTTP/1.1 101"));
}

// A raw peer whose WebSocket is open.
struct Upgraded {
  explicit Upgraded(Pair& pair) : peer(pair.server.network.listen_port()) {
    peer.send(upgrade_request());
    EXPECT_TRUE(peer.sees(pair.loop, "\r\n\r\n"));
    EXPECT_TRUE(pair.loop.until([&] { return !pair.server.opened.empty(); }));
    id = pair.accepted();
    peer.text.clear();
  }
  RawPeer peer;
  ConnectionId id;
};

TEST(Hostile, APeerThatDoesNotAnswerTheCloseIsCutAfterASecond) {
  Pair pair;
  Upgraded mute(pair);
  const auto begin = std::chrono::steady_clock::now();
  pair.server.network.close(mute.id, CloseCode::kNormal, "enough");
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.is_closed(mute.id); }));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1300ms);
  EXPECT_TRUE(mute.peer.ends(pair.loop, 100ms));
  EXPECT_EQ(mute.peer.text.substr(0, 10), std::string("\x88\x08\x03\xe8"
                                                      "enough",
                                                      10));
}

// A closed WebSocket is not a closed descriptor: its place is taken until that is closed, too.
TEST(Hostile, AClosedConnectionCountsUntilItsTcpConnectionIsGone) {
  ListenOptions options;
  options.connections_max = 1;
  Pair pair{options};
  Upgraded mute(pair);
  pair.server.network.close(mute.id, CloseCode::kNormal, "enough");
  mute.peer.send(std::string("\x88\x82\0\0\0\0\x03\xe8", 8));  // answers, and keeps it open
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.is_closed(mute.id); }, 500ms));
  EXPECT_FALSE(pair.connect(ConnectionId{1}));
  pair.loop.run_for(1100ms);
  EXPECT_TRUE(pair.connect(ConnectionId{2}));
}

TEST(Hostile, APeerThatDoesNotReadIsCutAfterASecond) {
  Pair pair;
  Upgraded mute(pair);
  pair.server.send(mute.id, std::string(20U << 20U, 'x'));
  pair.loop.run_for(50ms);
  pair.server.network.close(mute.id, CloseCode::kSlowPeer, "slow");
  EXPECT_TRUE(pair.loop.until([&] { return pair.server.is_closed(mute.id); }, 1300ms));
}

TEST(Hostile, BadFramesEndTheConnection) {
  const std::string frames[] = {
      std::string("\x82\x01"
                  "a",
                  3),  // not masked
      std::string("\xf2\x81\0\0\0\0"
                  "a",
                  7),  // reserved bits (compression)
      std::string("\x83\x81\0\0\0\0"
                  "a",
                  7),                                                       // unknown opcode
      std::string("\x81\x82\0\0\0\0\xff\xff", 8),                           // text that is no UTF-8
      std::string("\x80\x80\0\0\0\0", 6),                                   // continues nothing
      std::string("\x82\xff\xff\xff\xff\xff\xff\xff\xff\xff\0\0\0\0", 14),  // 2^64 - 1 bytes
      std::string("\x89\xfe\0\xff\0\0\0\0", 8),                             // ping of 255 bytes
      std::string("\x88\x81\0\0\0\0\3", 7),  // close frame with half a code
  };
  for (const auto& frame : frames) {
    Pair pair;
    Upgraded bad(pair);
    bad.peer.send(frame);
    EXPECT_TRUE(pair.loop.until([&] { return pair.server.is_closed(bad.id); }));
    EXPECT_FALSE(pair.server.closed[bad.id].reason.empty());
    EXPECT_TRUE(bad.peer.ends(pair.loop, 1500ms));
    EXPECT_EQ(bad.peer.text.substr(0, 1), "\x88");
    EXPECT_EQ(pair.server.packets(bad.id), 0U);
    EXPECT_EQ(pair.server.closed_count, 1U);
  }
}

TEST(Hostile, PingsAreAnswered) {
  Pair pair;
  Upgraded peer(pair);
  peer.peer.send(std::string("\x89\x82\0\0\0\0hi", 8));
  EXPECT_TRUE(peer.peer.sees(pair.loop, std::string("\x8a\x02hi", 4)));
}

TEST(Hostile, ADroppedConnectionIsReportedOnce) {
  Pair pair;
  {
    Upgraded gone(pair);
    gone.peer.send(std::string("\x82\x85\0\0\0\0he", 8));  // in the middle of a frame
  }
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.closed_count == 1; }));
  pair.loop.run_for(50ms);
  EXPECT_EQ(pair.server.closed_count, 1U);
  EXPECT_FALSE(pair.server.closed.begin()->second.code.has_value());
}

TEST(Hostile, APeerThatResetsWhileWeSendIsReportedOnce) {
  Pair pair;
  auto peer = std::make_unique<Upgraded>(pair);
  const ConnectionId id = peer->id;
  pair.server.send(id, std::string(20U << 20U, 'x'));
  pair.loop.run_for(20ms);
  peer.reset();  // unread data: the kernel sends a reset
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.is_closed(id); }));
  pair.loop.run_for(50ms);
  EXPECT_EQ(pair.server.closed_count, 1U);
  EXPECT_EQ(pair.server.network.counts().open, 0U);
}

TEST(Hostile, AServerThatIsNoneOfOursIsReported) {
  struct Case {
    std::string answer;
    Cause expected;
  };
  const Case cases[] = {
      {"SSH-2.0-OpenSSH_9.2\r\n\r\n", Cause::kPlainToTlsPort},
      {"HTTP/1.1 502 Bad Gateway\r\nContent-Length: 8\r\n\r\nupstream", Cause::kProxyWithoutServer},
      {"HTTP/1.1 503 Service Unavailable\r\nServer: nginx\r\nContent-Length: 0\r\n\r\n",
       Cause::kProxyWithoutServer},
      {"HTTP/1.1 401 Unauthorized\r\nContent-Length: 0\r\n\r\n", Cause::kHttpLogin},
      {"HTTP/1.1 403 Forbidden\r\nContent-Length: 0\r\n\r\n", Cause::kHttpLogin},
      {"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n", Cause::kPathWrong},
      {"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n", Cause::kProxyWithoutUpgrade},
      {"HTTP/1.1 426 Upgrade Required\r\nUpgrade: websocket\r\nContent-Length: 0\r\n\r\n",
       Cause::kProxyWithoutUpgrade},
      {"HTTP/1.1 426 Upgrade Required\r\nUpgrade: TLS/1.0, HTTP/1.1\r\nContent-Length: 0\r\n\r\n",
       Cause::kPlainToTlsPort},
      {"HTTP/1.1 302 Found\r\nContent-Length: 0\r\n\r\n", Cause::kCaptivePortal},
      {"HTTP/1.1 511 Network Authentication Required\r\nContent-Length: 0\r\n\r\n",
       Cause::kCaptivePortal},
      {"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n", Cause::kCaptivePortal},
      {"HTTP/1.1 200 OK\r\nContent-Length: 8198552921648689609\r\n\r\nx", Cause::kCaptivePortal},
      {"HTTP/1.1 200 OK\r\nContent-Length: 8388609\r\n\r\nx", Cause::kCaptivePortal},
      // Where the header ends is looked for from the first byte on.
      {"\r\n\r\nHTTP/1.1 200 OK\r\nContent-Length: 8198552921648689609\r\n\r\nx",
       Cause::kPlainToTlsPort},
      {"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: upgrade\r\n"
       "Sec-WebSocket-Accept: wrong\r\n\r\n",
       Cause::kNotThisProgram},
      {"HTTP/1.1 101", Cause::kNotThisProgram},
      {"", Cause::kServerSilent},
  };
  for (const auto& [text, expected] : cases) {
    Pair pair;
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
    pair.client.network.dial(kDial, options);
    pair.loop.run_for(30ms);
    const int accepted = ::accept(listener, nullptr, nullptr);
    pair.loop.run_for(30ms);
    char request[2048];
    EXPECT_GT(::recv(accepted, request, sizeof request, 0), 0);
    EXPECT_EQ(::send(accepted, text.data(), text.size(), 0), static_cast<ssize_t>(text.size()));
    ::close(accepted);
    ASSERT_TRUE(pair.loop.until([&] { return pair.client.failures.count(kDial) != 0; }));
    EXPECT_EQ(pair.client.causes[kDial], expected) << pair.client.failures[kDial];
    ::close(listener);
  }
}

}  // namespace
}  // namespace connect_bridge::test
