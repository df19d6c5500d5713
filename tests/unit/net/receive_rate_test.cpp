// Limits on what is read from a peer.
#include <gtest/gtest.h>

#include "unit/net/harness.hpp"

namespace connect_bridge::test {
namespace {

// Messages, bytes and the bytes of text have a rate each.
TEST(ReceiveRate, WhoSendsTooMuchIsReadSlowly) {
  SocketOptions sockets;
  sockets.receive_packets_per_second = 200;
  sockets.receive_bytes_per_second = 1'000'000;
  sockets.receive_text_bytes_per_second = 100'000;
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

  ASSERT_TRUE(pair.connect(ConnectionId{2}));
  const ConnectionId talker = pair.accepted();
  for (int i = 0; i < 10; ++i) pair.client.send({2}, std::string(10'000, 'x'), true);
  pair.loop.run_for(300ms);
  EXPECT_LT(pair.server.packets(talker), 6U);
  EXPECT_TRUE(pair.loop.until([&] { return pair.server.packets(talker) == 10U; }));

  ASSERT_TRUE(pair.connect(ConnectionId{3}));
  const ConnectionId camera = pair.accepted();
  for (int i = 0; i < 10; ++i) pair.client.send({3}, std::string(100'000, 'x'));
  pair.loop.run_for(300ms);
  EXPECT_LT(pair.server.packets(camera), 6U);
  EXPECT_TRUE(pair.loop.until([&] { return pair.server.packets(camera) == 10U; }));
}

}  // namespace
}  // namespace connect_bridge::test
