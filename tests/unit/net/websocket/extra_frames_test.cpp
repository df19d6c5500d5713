#include "net/websocket/extra_frames.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

// The handshake took 300 bytes.
TEST(ExtraFrames, MessagesHaveNone) {
  ExtraFrames frames(300);
  EXPECT_EQ(frames.count(300, 0, 0), 0U);
  EXPECT_EQ(frames.count(300 + 14 + 5000, 5000, 1), 0U);
  EXPECT_EQ(frames.count(300 + 14 + 5000 + 6 + 200, 5200, 2), 0U);
  EXPECT_EQ(frames.total(), 0U);
}

TEST(ExtraFrames, PingsAndPiecesAreCountedByTheirHeads) {
  ExtraFrames frames(300);
  // 14 bytes may be the head of the next message.
  EXPECT_EQ(frames.count(300 + 600, 0, 0), (600U - 14U) / 6U);
  EXPECT_EQ(frames.count(900 + 600, 0, 0), (600U - 14U) / 6U);
  EXPECT_EQ(frames.total(), 2 * ((600U - 14U) / 6U));
}

TEST(ExtraFrames, AFewBytesOfAMessageCostAsMuchAsAFrame) {
  ExtraFrames frames(300);
  EXPECT_EQ(frames.count(314 + 1000, 1000, 0), 0U);
  for (std::uint64_t i = 1; i <= 10; ++i) EXPECT_EQ(frames.count(1314 + i, 1000 + i, 0), 1U);
  EXPECT_EQ(frames.count(1324 + 128, 1010 + 128, 0), 0U);  // no network cuts smaller
  EXPECT_EQ(frames.total(), 10U);
}

}  // namespace
}  // namespace connect_bridge
