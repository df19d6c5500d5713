// How much is taken of a peer before its login.
#include "net/websocket/gate.hpp"

#include <gtest/gtest.h>

namespace connect_bridge::test {
namespace {

constexpr std::uint64_t kHandshake = 300;
constexpr std::uint64_t kBytes = 16384;  // docs/protocol.md, "Limits"
constexpr std::uint64_t kStep = 8;       // what a read or a message costs beside its bytes

TEST(Gate, CountsBytesBehindTheHandshakeAndWhatEachReadCosts) {
  Gate gate(kHandshake);
  EXPECT_TRUE(gate.admits(kHandshake + kBytes - 2 * kStep, false));
  EXPECT_TRUE(gate.admits(kHandshake + kBytes - 2 * kStep, false));
  EXPECT_FALSE(gate.admits(kHandshake + kBytes - 2 * kStep, false));
}

TEST(Gate, SoManyReadsComeThatBringNothing) {
  Gate gate(kHandshake);
  std::uint64_t reads = 0;
  while (reads < 10'000 && gate.admits(kHandshake, false)) ++reads;
  EXPECT_EQ(reads, kBytes / kStep);
}

TEST(Gate, FourTimesAsMuchMayBeOnItsWayWhenItIsClosed) {
  Gate gate(kHandshake);
  EXPECT_TRUE(gate.admits(kHandshake + 4 * kBytes - kStep, true));
  EXPECT_FALSE(gate.admits(kHandshake + 4 * kBytes - kStep, true));
}

TEST(Gate, TakesAllWhenItIsOpen) {
  Gate gate(kHandshake);
  gate.open();
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(gate.admits(1ULL << 50U, false));
}

}  // namespace
}  // namespace connect_bridge::test
