// Limits on what is read from a peer.
#include <gtest/gtest.h>

#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

TEST(ReceiveRate, WhoSendsTooMuchIsReadSlowly) {
  SocketOptions sockets;
  sockets.receive_packets_per_second = 200;
  sockets.receive_burst = 100ms;
  Pair pair{{}, sockets};
  ASSERT_TRUE(pair.connect());
  const ConnectionId id = pair.accepted();
  for (int i = 0; i < 300; ++i) pair.client.send(kDial, "small");
  pair.loop.run_for(300ms);
  EXPECT_GE(pair.server.packets(id), 20U);
  EXPECT_LT(pair.server.packets(id), 120U);
  EXPECT_TRUE(pair.loop.until([&] { return pair.server.packets(id) == 300U; }));
  EXPECT_GT(pair.server.network.counts().held, 0U);
  EXPECT_EQ(pair.server.network.counts().extra_frames, 0U);
}

// ---- frames that are no messages

SocketOptions two_thousand() {
  SocketOptions sockets;
  sockets.receive_packets_per_second = 2000;
  sockets.receive_burst = 100ms;
  return sockets;
}

std::string frame(char head, const std::string& content = "") {
  return std::string{head, static_cast<char>(0x80 | content.size())} + std::string(4, '\0') +
         content;
}

std::string times(int count, const std::string& what) {
  std::string text;
  for (int i = 0; i < count; ++i) text += what;
  return text;
}

// 3000 of them, of which 200 pass at once, stand before the end of a message.
void expect_counted(const std::string& begin, const std::string& each, const std::string& end) {
  Pair pair{{}, two_thousand()};
  RawPeer peer(pair.server.network.listen_port());
  peer.send(upgrade_request());
  ASSERT_TRUE(pair.loop.until([&] { return !pair.server.opened.empty(); }));
  const auto start = std::chrono::steady_clock::now();
  peer.send(begin + times(3000, each) + end);
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.packets(pair.accepted()) == 1; }));
  EXPECT_GE(std::chrono::steady_clock::now() - start, 1s);
  EXPECT_EQ(text_of(pair.server.received[pair.accepted()].front().payload), "end");
  const NetworkCounts counts = pair.server.network.counts();
  EXPECT_GE(counts.extra_frames, 2500U);
  EXPECT_LE(counts.extra_frames, 3002U);
  EXPECT_GT(counts.held, 0U);
}

TEST(ReceiveRate, PingsCountAsMessages) {
  expect_counted("", frame('\x89'), frame('\x82', "end"));
}

TEST(ReceiveRate, SoDoFramesWithoutContent) {
  expect_counted(frame('\x02'), frame('\0'), frame('\x80', "end"));
}

TEST(ReceiveRate, SoDoReadsOfAFewBytes) {
  Pair pair;
  RawPeer peer(pair.server.network.listen_port());
  peer.send(upgrade_request());
  ASSERT_TRUE(pair.loop.until([&] { return !pair.server.opened.empty(); }));
  for (int round = 0; round < 10; ++round) {
    for (const char byte : frame('\x82', std::string(100, 'x'))) {
      peer.send({&byte, 1});
      pair.loop.io.poll();
      pair.loop.io.restart();
    }
  }
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.packets(pair.accepted()) == 10; }));
  EXPECT_GE(pair.server.network.counts().extra_frames, 800U);
  EXPECT_LE(pair.server.network.counts().extra_frames, 1060U);
}

// All at once, or two by two, so that each read brings little.
TEST(ReceiveRate, FewPingsComeBeforeALogin) {
  for (const int at_once : {5000, 2}) {
    Pair pair;
    pair.server.packet_bytes_max = 0;
    RawPeer peer(pair.server.network.listen_port());
    peer.send(upgrade_request());
    ASSERT_TRUE(pair.loop.until([&] { return !pair.server.opened.empty(); }));
    const std::string pings = times(at_once, frame('\x89'));
    for (int sent = 0; sent < 5000 && !peer.ended; sent += at_once) {
      peer.send(pings);
      pair.loop.io.restart();
      pair.loop.io.poll();
      peer.poll();
    }
    EXPECT_TRUE(peer.ends(pair.loop)) << at_once;
    EXPECT_TRUE(pair.loop.until([&] { return pair.server.is_closed(pair.accepted()); }));
    EXPECT_LE(std::count(peer.text.begin(), peer.text.end(), '\x8a'), 3500);
  }
}

// All of them are there at a time: they cost few reads.
TEST(ReceiveRate, SoDoFewMessages) {
  Pair pair;
  pair.server.packet_bytes_max = 0;
  RawPeer peer(pair.server.network.listen_port());
  peer.send(upgrade_request());
  ASSERT_TRUE(pair.loop.until([&] { return !pair.server.opened.empty(); }));
  peer.send(times(5000, frame('\x82')));
  EXPECT_TRUE(peer.ends(pair.loop));
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.is_closed(pair.accepted()); }));
  EXPECT_GE(pair.server.packets(pair.accepted()), 1000U);
  EXPECT_LE(pair.server.packets(pair.accepted()), 16384U / (6 + 8));
}

// The time for its answer to our close frame is a second.
TEST(ReceiveRate, NorWhileAStrangerIsRefused) {
  Pair pair;
  pair.server.packet_bytes_max = 0;
  RawPeer peer(pair.server.network.listen_port());
  peer.send(upgrade_request());
  ASSERT_TRUE(pair.loop.until([&] { return !pair.server.opened.empty(); }));
  pair.server.network.close(pair.accepted(), CloseCode::kLoginRefused, "no");
  peer.send(times(20'000, frame('\x89')));
  EXPECT_TRUE(peer.ends(pair.loop, 700ms));
}

TEST(ReceiveRate, AConnectionThatIsHeldCanBeClosed) {
  SocketOptions sockets = two_thousand();
  sockets.receive_packets_per_second = 1;
  Pair pair{{}, sockets};
  RawPeer peer(pair.server.network.listen_port());
  peer.send(upgrade_request());
  ASSERT_TRUE(pair.loop.until([&] { return !pair.server.opened.empty(); }));
  peer.send(times(3000, frame('\x89')));
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.network.counts().held > 0; }));
  pair.server.network.close(pair.accepted(), CloseCode::kGoingAway, "enough");
  EXPECT_TRUE(peer.ends(pair.loop));
  EXPECT_TRUE(pair.loop.until([&] { return pair.server.is_closed(pair.accepted()); }));
}

}  // namespace
}  // namespace connect_bridge::test
