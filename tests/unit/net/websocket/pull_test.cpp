// When a connection is asked for its next packet.
#include <gtest/gtest.h>

#include <filesystem>

#include "net/tcp/socket_tuning.hpp"
#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

TEST(Pull, IsOnlyOfConnectionsThatHaveSomethingToSend) {
  Pair pair;
  ASSERT_TRUE(pair.connect());
  pair.client.send(kDial, "one");
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.packets(pair.accepted()) == 1; }));
  EXPECT_GT(pair.client.asked, 0U);
  const auto before = pair.client.asked;
  for (int i = 0; i < 10; ++i) pair.client.network.read_on(kDial);
  EXPECT_EQ(pair.client.asked, before);
  EXPECT_EQ(pair.server.asked, 0U);
}

// This process's socket at the other end of a peer's connection.
int other_end_of(const RawPeer& peer) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int socket = std::stoi(entry.path().filename());
    sockaddr_in end{};
    socklen_t size = sizeof end;
    if (::getpeername(socket, reinterpret_cast<sockaddr*>(&end), &size) == 0 &&
        end.sin_port == peer.address().sin_port)
      return socket;
  }
  ADD_FAILURE() << "there is no such socket";
  return -1;
}

TEST(Pull, ComesOnlyWhenTheKernelHasLittleLeft) {
  Pair pair;
  ASSERT_TRUE(pair.connect());
  const ConnectionId other{78};
  RawPeer slow(pair.server.network.listen_port());
  slow.send(upgrade_request());
  ASSERT_TRUE(slow.sees(pair.loop, "101 Switching"));
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.opened.size() == 2; }));
  const ConnectionId id = pair.accepted();
  const Payload piece = Payload::adopt(Bytes(16384));
  for (int i = 0; i < 2000; ++i) pair.server.send(id, Packet{false, {piece}});
  pair.loop.run_for(300ms);
  // The peer reads nothing: its window fills, then at most the low-water mark and a packet waits
  // here.
  EXPECT_FALSE(pair.server.out[id].empty());
  EXPECT_LT(unsent_bytes(other_end_of(slow)), 3 * 16384U);
  // Others do not suffer.
  ASSERT_TRUE(pair.connect(other));
}

}  // namespace
}  // namespace connect_bridge::test
